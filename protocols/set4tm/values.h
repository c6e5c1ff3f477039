// The data bytes of a reply to values and back, by the decoder of a field.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "protocols/common/decoded.h"
#include "protocols/set4tm/points.h"

namespace baudgate::protocols::set4tm {

/// Never a number for what the meter marks as missing, nor for a scale that is not known.
Decoded DecodeField(const Field& field, View data, const Scale& scale);
/// Writes `value` into the reply's data as the meter would; false leaves the data as it was.
bool EncodeField(const Field& field, const Value& value, const Scale& scale, Bytes& data);

}  // namespace baudgate::protocols::set4tm
