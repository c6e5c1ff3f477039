// The value in a reply of the example, "=5", to and from a point's.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <string_view>

#include "protocols/common/decoded.h"

namespace baudgate::protocols::example {

/// "=5" is 5. The sensor is broken where anything else stands: never a number.
Decoded DecodeValue(std::string_view content);
std::string EncodeValue(const Value& value);

}  // namespace baudgate::protocols::example
