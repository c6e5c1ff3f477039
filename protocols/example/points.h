// What may stand in `read` of a point: the number of an item, 1 to 999. DecodeValue and EncodeValue
// convert the value in a reply.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>
#include <string>
#include <string_view>

#include "config/model/point.h"
#include "protocols/common/decoded.h"
#include "protocols/protocol.h"

namespace baudgate::protocols::example {

Result<unsigned> ParseItem(const config::Point& point);

Status CheckPoint(const config::Point& point);

std::span<const DecoderSpec> DecoderTable();

// The value in a reply of the example, "=5", to and from a point's.

/// "=5" is 5. The sensor is broken where anything else stands: never a number.
Decoded DecodeValue(std::string_view content);
std::string EncodeValue(const Value& value);

}  // namespace baudgate::protocols::example
