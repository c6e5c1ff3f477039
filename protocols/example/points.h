// `ParseItem` parses the `read` text of a point: the number of an item, 1 to 999. DecodeValue and
// EncodeValue convert the value in a reply.
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

/// Converts "=5" to 5. Any other text gives the quality for a broken sensor and no number.
Decoded DecodeValue(std::string_view content);
std::string EncodeValue(const Value& value);

}  // namespace baudgate::protocols::example
