// How one field of a telegram is written: as text ("+07.3f", "decimal", "word") or as bytes
// ("uint16_le", "bcd3"). The words of a description are parsed here once; nothing of them ever
// reaches printf or fmt.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <string_view>

#include "config/model/point.h"
#include "gateway/base/result.h"

namespace baudgate::protocols::telegram {

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

}  // namespace baudgate::protocols::telegram
