// Decodes and encodes one field of a telegram. `Format` describes how the field is written.
// `Meaning` is the meaning of a code, which is a text or number in the place of a measurement. A
// field that is not entirely a valid number gives no number.
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
// ("uint16_le", "bcd3"). These words of a description are parsed here, and never passed to printf
// or fmt.
struct Format {
  enum class Kind : std::uint8_t {
    decimal,     ///< "12.5"
    scientific,  ///< "1.25E+01"
    integer,     ///< "12"
    hex,         ///< "0C"
    character,
    word,   ///< characters without blanks
    text,   ///< characters, blanks among them
    bytes,  ///< any bytes, which are skipped
    byte,   ///< one byte, whose meaning only codes define
    uint,   ///< binary, unsigned, `width` bytes
    sint,
    real,
    bcd,  ///< two digits per byte
  } kind = Kind::text;
  std::size_t width = 0;  ///< number of characters or bytes; 0: any number
  int precision = -1;     ///< number of decimals; -1: any number
  bool sign = false;      ///< true: a number always has a sign
  bool point = false;   ///< true: a number always has a point, so a text without a point is a code
  bool zeros = false;   ///< true: padded with zeros, not with blanks
  bool left = true;     ///< true: a number can be at the left of its width, with blanks behind it
  bool lower = false;   ///< true: hex digits in lower case
  bool little = false;  ///< true: binary with the low byte first

  /// True if the field contains characters; false if it contains binary data.
  bool is_text() const { return kind < Kind::bytes; }
  bool is_binary() const { return kind >= Kind::uint; }
  bool is_text_number() const { return kind <= Kind::hex; }
  bool is_number() const { return is_text_number() || is_binary(); }
  bool is_whole_number() const;
  /// True if the sign in front of a number separates the field from the field before. Example:
  /// "+025.12-020.45" are two fields.
  bool is_signed_token() const {
    return sign && (kind == Kind::decimal || kind == Kind::integer || kind == Kind::scientific);
  }
  /// Returns how many bits a whole number in this field has. Empty: the number of bits is unknown.
  std::optional<unsigned> bits() const;
  bool is_fixed() const { return width != 0 && !is_signed_token(); }

  bool operator==(const Format&) const = default;
};

config::RawNumbers NumbersOf(const Format& format);

/// Parses a format. An empty text gives the format of a text field.
Result<Format> ParseFormat(std::string_view text);

constexpr bool IsPrintable(std::uint8_t byte) { return byte >= 0x20 && byte < 0x7F; }

/// Decodes the bytes of a field. The value is empty if the bytes are not a number of this format. A
/// text is returned without the blanks around it.
Value DecodeField(const Format& format, View bytes);

/// Returns the bytes in hex: "0x1A".
std::string ByteText(View bytes);

/// Encodes a value without rounding. Fails with the reason if the format cannot express the value:
/// too wide, out of range, more digits than the format has, a control character.
Result<Bytes> EncodeField(const Format& format, const Value& value);

/// Returns the number that is nearest to `value` and that the format can express. A simulated
/// number gets as many digits as a device would show.
Value Nearest(const Format& format, const Value& value);

/// Returns blanks or zero bytes in the width of the field, for a field without a value.
Bytes BlankField(const Format& format);

/// True if the values are equal. Two texts are compared as texts; otherwise both are compared as
/// numbers, so 7 equals "007".
bool SameValue(const Value& a, const Value& b);

// The meaning of a code in a field. Examples: "I" means busy, "+9999.9" over range.
struct Meaning {
  std::string_view word;
  Quality quality;
  bool busy = false;  ///< true: the device asks to be asked again later
};

/// Returns the known meanings: good, uncertain, busy, over, under, open, disabled, not_ready,
/// fault, bad.
std::span<const Meaning> Meanings();

/// The codes of a field. The key is the text of the field without the blanks around it, or "0x1A"
/// for a byte.
using Codes = std::map<std::string, const Meaning*, std::less<>>;

/// Returns the meaning of a field's content. Null: no code fits. Codes of binary and scientific
/// numbers are compared as numbers, all others as texts. "9.9E37..", "..-9.9E37" and "900..999" are
/// ranges of a number, ends included; a code for a single number takes precedence over a range that
/// contains the number.
const Meaning* FindCode(const Codes& codes, const Format& format, View bytes, const Value& value);

/// Checks a code. The error gives the reason why a field of this format cannot contain the code.
Status CheckCode(const Format& format, std::string_view code);

/// Returns a number that a simulated device can send for the code. Empty: the code is a text.
Value NumberOf(const Format& format, std::string_view code);

}  // namespace baudgate::protocols::telegram
