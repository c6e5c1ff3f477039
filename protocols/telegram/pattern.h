// The bytes of a telegram as a description writes them: text with escapes, or hex, with fields.
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

/// A token without a point is a code, and up to so many characters shorter than a number.
inline constexpr std::size_t kShorterCode = 2;

inline constexpr std::string_view kAddress = "address";
inline constexpr std::string_view kPassword = "password";
inline constexpr std::string_view kValue = "value";
inline constexpr std::string_view kChecksum = "checksum";

/// Bytes that are always the same, or a field.
struct Element {
  Bytes literal{};     ///< empty: a field
  std::string name{};  ///< empty: passed over
  Format format{};

  bool is_field() const { return literal.empty(); }
  /// Its size is known beforehand.
  bool is_fixed() const { return !is_field() || format.is_fixed(); }
  std::size_t fixed_size() const { return is_field() ? format.width : literal.size(); }
};

struct Pattern {
  std::vector<Element> elements;
  bool has_repeats = false;  ///< a field stands twice, and has to say the same

  /// Null: it has no such field.
  const Element* Find(std::string_view name) const;
  bool Has(std::string_view name) const { return Find(name) != nullptr; }
  std::size_t least_size() const;
  /// Empty: that depends on what is said.
  std::optional<std::size_t> size() const;
  /// The least and the greatest size of telegrams whose fields are what they should be. The second
  /// is nothing where any number of bytes may be there.
  std::pair<std::size_t, std::optional<std::size_t>> usual_sizes() const;
  /// How the end of a text field without a width is found: by fixed characters, and by how
  /// many characters of other fields stand between. "{weight:decimal}{checksum:02X}\r": "\r",
  /// and 2.
  struct Anchor {
    const Bytes* literal = nullptr;
    std::size_t between = 0;
  };
  /// Empty: it ends where its own characters do, or with the telegram.
  std::optional<Anchor> AnchorOf(std::size_t index) const;
  /// Bytes that are always the same.
  std::size_t literal_size() const;
  /// Only silence, or a known size, ends it.
  bool is_open() const { return !elements.empty() && !elements.back().is_fixed(); }
};

struct PatternError {
  std::string message;
  std::size_t at = 0;  ///< the character of the text that is wrong, from 0 on
};

/// Exactly one of the two has a value.
struct ParsedPattern {
  std::optional<Pattern> pattern{};
  std::optional<PatternError> error{};
};
ParsedPattern ParsePattern(std::string_view text);

}  // namespace baudgate::protocols::telegram
