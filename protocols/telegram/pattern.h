// `Pattern` is the bytes of a telegram as a description writes them: text with escapes, or hex,
// with fields.
//   'S {state:char} {weight:10decimal} {unit:word}\r\n'
//   'hex 05 08 {address:uint8} 00'
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "gateway/base/bytes.h"
#include "gateway/base/result.h"
#include "protocols/telegram/field.h"

namespace baudgate::protocols::telegram {

/// A signed number field can contain a code, which has no decimal point. The code can be up to this
/// many characters shorter than the field.
inline constexpr std::size_t kShorterCode = 2;

inline constexpr std::string_view kAddress = "address";
inline constexpr std::string_view kPassword = "password";
inline constexpr std::string_view kValue = "value";
inline constexpr std::string_view kChecksum = "checksum";

struct Element {
  Bytes literal{};     ///< the fixed bytes; empty: the element is a field
  std::string name{};  ///< name of the field; empty: the field is skipped
  Format format{};

  bool is_field() const { return literal.empty(); }
  /// True if the size of the element does not depend on its content.
  bool is_fixed() const { return !is_field() || format.is_fixed(); }
  std::size_t fixed_size() const { return is_field() ? format.width : literal.size(); }
};

struct Pattern {
  std::vector<Element> elements;
  /// True: a field occurs twice, and must have the same bytes in both places.
  bool has_repeats = false;

  const Element* Find(std::string_view name) const;
  bool Has(std::string_view name) const { return Find(name) != nullptr; }
  std::size_t least_size() const;
  /// Returns the size of the telegram. Empty: the size depends on the content.
  std::optional<std::size_t> size() const;
  /// Returns the smallest and the largest size of a telegram. A signed number can be a shorter code
  /// (kShorterCode). Fields without a width count as empty in the smallest size; the largest is
  /// then unknown.
  std::pair<std::size_t, std::optional<std::size_t>> usual_sizes() const;
  /// How the end of a text field without a width is found: the next fixed characters (`literal`),
  /// and how many characters of other fields are in front of them (`between`). Example: "\r" and 2
  /// for the first field of "{weight:decimal}{checksum:02X}\r".
  struct Anchor {
    const Bytes* literal = nullptr;
    std::size_t between = 0;
  };
  /// Returns the anchor of the field elements[index]. Empty: the field ends with its own
  /// characters, or with the telegram.
  std::optional<Anchor> AnchorOf(std::size_t index) const;
  std::size_t literal_size() const;
  /// True if only silence or a known size ends the telegram.
  bool is_open() const { return !elements.empty() && !elements.back().is_fixed(); }
};

struct PatternError {
  std::string message;
  std::size_t at = 0;  ///< offset of the wrong character in the text
};

/// The result of ParsePattern. Exactly one of the members has a value.
struct ParsedPattern {
  std::optional<Pattern> pattern{};
  std::optional<PatternError> error{};
};
ParsedPattern ParsePattern(std::string_view text);

}  // namespace baudgate::protocols::telegram
