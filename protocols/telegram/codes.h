// Texts and numbers of a field that are no measurement: "I" is busy, "+9999.9" over range.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <map>
#include <optional>
#include <span>
#include <string>
#include <string_view>

#include "gateway/base/bytes.h"
#include "gateway/base/quality.h"
#include "gateway/base/result.h"
#include "gateway/base/value.h"
#include "protocols/telegram/format.h"

namespace baudgate::protocols::telegram {

struct Meaning {
  std::string_view word;
  Quality quality;
  bool busy = false;  ///< the device wants to be asked again
};

/// good, uncertain, busy, over, under, open, disabled, not_ready, fault, bad.
std::span<const Meaning> Meanings();

/// By what stands in the field, without the blanks around it; of a byte, by "0x1A".
using Codes = std::map<std::string, const Meaning*, std::less<>>;

/// Null: the field has none of them. Codes of binary and of scientific numbers are compared as
/// numbers, all others as texts. "9.9E37..", "..-9.9E37" and "900..999" are ranges of a number,
/// ends included; a code of its own goes before a range that holds it.
const Meaning* FindCode(const Codes& codes, const Format& format, View bytes, const Value& value);

/// What is wrong with a code of a field of this format.
Status CheckCode(const Format& format, std::string_view code);

/// A number that the code means in such a field, for a twin; empty: the code is a text.
Value NumberOf(const Format& format, std::string_view code);

}  // namespace baudgate::protocols::telegram
