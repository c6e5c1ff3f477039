// The data bytes of a reply to values and back, by the decoder of a field. FromCp1251 and ToCp1251
// convert texts.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <string_view>

#include "gateway/base/bytes.h"
#include "protocols/common/decoded.h"
#include "protocols/set4tm/meter/points.h"

namespace baudgate::protocols::set4tm {

// Windows-1251 text of a meter (its metering point's name) to and from UTF-8.

/// Up to the first zero byte, without blanks at the end; control bytes become '?'.
std::string FromCp1251(View bytes);
/// Characters that Windows-1251 does not have become '?'.
Bytes ToCp1251(std::string_view utf8);

/// Never a number for what the meter marks as missing, nor for a scale that is not known.
Decoded DecodeField(const Field& field, View data, const Scale& scale);
/// Writes `value` into the reply's data as the meter would; false leaves the data as it was.
bool EncodeField(const Field& field, const Value& value, const Scale& scale, Bytes& data);

}  // namespace baudgate::protocols::set4tm
