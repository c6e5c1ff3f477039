// Converts reply data to values and back, by a field's decoder, and Windows-1251 texts to UTF-8.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <string_view>

#include "gateway/base/bytes.h"
#include "protocols/common/decoded.h"
#include "protocols/set4tm/meter/points.h"

namespace baudgate::protocols::set4tm {

/// Converts a text up to its first zero byte to UTF-8, without trailing blanks. Control bytes
/// become '?'.
std::string FromCp1251(View bytes);
Bytes ToCp1251(std::string_view utf8);

/// Decodes the value of `field` from the data of a reply. For a missing value or an unknown
/// constant the result has a bad quality and no number.
Decoded DecodeField(const Field& field, View data, const Scale& scale);
/// Writes `value` into the data as the meter would. If the value does not fit, returns false and
/// leaves the data unchanged.
bool EncodeField(const Field& field, const Value& value, const Scale& scale, Bytes& data);

}  // namespace baudgate::protocols::set4tm
