// Converts reply data to values and back, by a field's decoder, and Windows-1251 texts to UTF-8.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <string_view>

#include "gateway/base/bytes.h"
#include "protocols/common/decoded.h"
#include "protocols/set4tm/meter/points.h"

namespace baudgate::protocols::set4tm {

// Texts of a meter (the name of its metering point) are in Windows-1251.

/// Converts the text up to the first zero byte, without trailing blanks. Control bytes become '?'.
std::string FromCp1251(View bytes);
/// Characters that Windows-1251 does not contain become '?'.
Bytes ToCp1251(std::string_view utf8);

/// Returns a bad quality, never a number, for a missing value or an unknown constant.
Decoded DecodeField(const Field& field, View data, const Scale& scale);
/// Writes `value` into the data as the meter would. Returns false, unchanged, if it does not fit.
bool EncodeField(const Field& field, const Value& value, const Scale& scale, Bytes& data);

}  // namespace baudgate::protocols::set4tm
