// Whether bytes are a telegram of a pattern: the one place that says where one ends. Checksum has
// the check values that a description may name.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "gateway/base/bytes.h"
#include "gateway/base/value.h"
#include "protocols/telegram/pattern.h"

namespace baudgate::protocols::telegram {

// The check values that a description may name.
struct ChecksumKind {
  std::string_view name;
  std::size_t bytes = 1;
  std::uint32_t (*compute)(View bytes) = nullptr;
};

std::span<const ChecksumKind> ChecksumKinds();

/// The check value of a telegram: over the bytes in front of the field `checksum`, without the
/// first `skip` and the last `leave` of them.
struct Checksum {
  const ChecksumKind* kind = nullptr;  ///< null: none
  std::size_t skip = 0;
  std::size_t leave = 0;

  /// `front`: all in front of the field. Empty: it is too short.
  std::optional<std::uint32_t> Of(View front) const;
};

/// What is known of fields beforehand: address, parameters, what was sent.
using Bound = std::map<std::string, Value, std::less<>>;

/// A size that the telegram itself says.
struct SizeField {
  std::size_t at = 0;
  Format format{};
  std::size_t plus = 0;
};

/// How telegrams of one direction are put together.
struct Form {
  Pattern pattern;
  Checksum checksum;
  std::optional<SizeField> size_at;
  bool is_answer = false;  ///< to what was sent

  /// Almost nothing in it is fixed, as in the one byte ACK: many a damaged telegram has it.
  bool is_scant() const {
    constexpr std::size_t kFewBytes = 2;
    return is_answer && checksum.kind == nullptr && !pattern.elements.front().is_field() &&
           pattern.literal_size() <= kFewBytes;
  }
  /// It could be found inside another telegram that was damaged: it has no check value, and begins
  /// with a field or is scant. It is taken only at the begin of what comes (rules.cpp), and
  /// has at most half of the longest.
  bool is_unmarked() const {
    return (checksum.kind == nullptr && pattern.elements.front().is_field()) || is_scant();
  }
  /// Nothing fixed ends it: what comes after it in the same breath shows that its bytes are
  /// shifted.
  bool ends_with_silence() const { return is_unmarked() && pattern.elements.back().is_field(); }
};

struct Match {
  enum class Kind : std::uint8_t {
    none,       ///< the bytes are no such telegram, whatever follows
    need_more,  ///< they may become one
    whole,
  } kind = Kind::none;
  /// They are none, and yet the fixed bytes at its front were there: it is a damaged one.
  bool began = false;
  bool bad_checksum = false;  ///< they are none, and all else was right
  bool other = false;  ///< it is whole, and names another device or repeats what was not sent
  std::size_t size = 0;
  std::vector<View> parts{};  ///< by element; views of the bytes

  /// The bytes of the field; empty where the pattern has none of this name.
  View Of(const Pattern& pattern, std::string_view name) const;
};

/// At the front of `held`. `idle`: nothing follows any more. `most`: no telegram is longer.
Match MatchFront(const Form& form, View held, bool idle, std::size_t most, const Bound& known);
/// All of `bytes`, or none.
Match MatchAll(const Form& form, View bytes, const Bound& known);

/// What the fields of a match say; numbers that are none have no value.
Bound ValuesOf(const Form& form, const Match& match);

/// The telegram with these values. Fields that have none are as in `rest`, a telegram of the same
/// form, or blank without it. The error names the field.
Result<Bytes> Build(const Form& form, const Bound& values, const Match* rest = nullptr);

}  // namespace baudgate::protocols::telegram
