// One field: from its bytes to a value and back. A number is taken whole or not at all.
// SPDX-License-Identifier: Apache-2.0
#pragma once

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

/// The error says why `value` cannot be written so: too wide, out of range, a control character.
Result<Bytes> EncodeField(const Format& format, const Value& value);

/// As many blanks, or digits, as the field is wide: what cannot be told otherwise.
Bytes BlankField(const Format& format);

/// The same number, however each is written, or the same text.
bool SameValue(const Value& a, const Value& b);

}  // namespace baudgate::protocols::telegram
