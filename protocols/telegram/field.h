// One field: from its bytes to a value and back. A number is taken whole or not at all. Format says
// how a field is written, and Meaning is a text or number that is no measurement.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <string_view>

#include "config/model/point.h"
#include "gateway/base/bytes.h"
#include "gateway/base/result.h"
#include "gateway/base/value.h"

namespace baudgate::protocols::telegram {

// How one field of a telegram is written: as text ("+07.3f", "decimal", "word") or as bytes
// ("uint16_le", "bcd3"). The words of a description are parsed here once; nothing of them ever
// reaches printf or fmt.
struct Format {
  enum class Kind : std::uint8_t {
    decimal,     ///< "12.5"
    scientific,  ///< "1.25E+01"
    integer,     ///< "12"
    hex,         ///< "0C"
    character,   ///< one
    word,        ///< without blanks
    text,        ///< blanks among it
    bytes,       ///< any: they are passed over
    byte,        ///< one, of which only codes say what it means
    uint,        ///< binary, `width` bytes
    sint,
    real,
    bcd,  ///< two digits a byte
  } kind = Kind::text;
  std::size_t width = 0;  ///< characters or bytes; 0: as many as there are
  int precision = -1;     ///< digits after the point; -1: any number
  bool sign = false;      ///< it always has one
  bool point = false;     ///< it always has a point; what has none is a code
  bool zeros = false;     ///< filled up with zeros, not with blanks
  bool left = true;       ///< it may stand at the left of its width, blanks behind it
  bool lower = false;     ///< of hex
  bool little = false;    ///< binary, low byte first

  /// It is written in characters, not in bytes.
  bool is_text() const { return kind < Kind::bytes; }
  bool is_binary() const { return kind >= Kind::uint; }
  bool is_text_number() const { return kind <= Kind::hex; }
  bool is_number() const { return is_text_number() || is_binary(); }
  bool is_whole_number() const;
  /// Cut by its sign: "+025.12-020.45" are two.
  bool is_signed_token() const {
    return sign && (kind == Kind::decimal || kind == Kind::integer || kind == Kind::scientific);
  }
  /// The width of a whole number, if it is known.
  std::optional<unsigned> bits() const;
  /// Always `width` bytes.
  bool is_fixed() const { return width != 0 && !is_signed_token(); }

  bool operator==(const Format&) const = default;
};

/// The numbers that such a field can say.
config::RawNumbers NumbersOf(const Format& format);

/// "": text. The error names what is wrong with it.
Result<Format> ParseFormat(std::string_view text);

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

// Texts and numbers of a field that are no measurement: "I" is busy, "+9999.9" over range.
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
