// One field: from its bytes to a value and back. A number is taken whole or not at all.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "gateway/base/bytes.h"
#include "gateway/base/result.h"
#include "gateway/base/value.h"
#include "protocols/telegram/format.h"

namespace baudgate::protocols::telegram {

/// Whether this character may stand in a field of text.
constexpr bool IsPrintable(std::uint8_t byte) { return byte >= 0x20 && byte < 0x7F; }

/// Nothing (no alternative of the value): it is no number of this format. Texts come without the
/// blanks around them.
Value DecodeField(const Format& format, View bytes);

/// "0x1A"
std::string ByteText(View bytes);

/// The error says why `value` cannot be written so: too wide, out of range, more digits than the
/// format has, a control character. Nothing is rounded.
Result<Bytes> EncodeField(const Format& format, const Value& value);

/// The nearest number that the format can express; of one that a simulation has made up, so many
/// digits as a device would show.
Value Nearest(const Format& format, const Value& value);

/// As many blanks, or digits, as the field is wide: what cannot be told otherwise.
Bytes BlankField(const Format& format);

/// The same number, however each is written, or the same text.
bool SameValue(const Value& a, const Value& b);

}  // namespace baudgate::protocols::telegram
