// `MatchFront` and `MatchAll` decide whether bytes are a telegram of a pattern, and where it ends;
// `Build` makes a telegram. `Checksum` is the check value of a telegram.
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

struct ChecksumKind {
  std::string_view name;
  std::size_t bytes = 1;
  std::uint32_t (*compute)(View bytes) = nullptr;
};

std::span<const ChecksumKind> ChecksumKinds();

/// How the check value of a telegram is computed: over the bytes in front of the field `checksum`,
/// without the first `skip` and the last `leave` bytes.
struct Checksum {
  const ChecksumKind* kind = nullptr;  ///< null: there is no check value
  std::size_t skip = 0;
  std::size_t leave = 0;

  /// `front`: all bytes in front of the field. Returns nothing if they are too few.
  std::optional<std::uint32_t> Of(View front) const;
};

/// Values of fields that are known beforehand: address, parameters, fields that were sent.
using Bound = std::map<std::string, Value, std::less<>>;

/// A field that contains the size of the telegram.
struct SizeField {
  std::size_t at = 0;
  Format format{};
  std::size_t plus = 0;
};

struct Form {
  Pattern pattern;
  Checksum checksum;
  std::optional<SizeField> size_at;
  bool is_answer = false;  ///< the telegram answers a sent telegram

  /// True if almost no bytes are fixed, as in the one byte ACK: many damaged telegrams contain it.
  bool is_scant() const {
    constexpr std::size_t kFewBytes = 2;
    return is_answer && checksum.kind == nullptr && !pattern.elements.front().is_field() &&
           pattern.literal_size() <= kFewBytes;
  }
  /// True if such a telegram could be found inside another, damaged telegram: it has no check
  /// value, and begins with a field or is scant. It is accepted only at the beginning of the
  /// received bytes (rules.cpp), and has at most half of the longest size.
  bool is_unmarked() const {
    return (checksum.kind == nullptr && pattern.elements.front().is_field()) || is_scant();
  }
  /// True if no fixed bytes end the telegram: bytes that follow without a pause show that its bytes
  /// are shifted.
  bool ends_with_silence() const { return is_unmarked() && pattern.elements.back().is_field(); }
};

struct Match {
  enum class Kind : std::uint8_t {
    none,       ///< the bytes are no such telegram, even if more bytes follow
    need_more,  ///< the bytes may become such a telegram
    whole,
  } kind = Kind::none;
  /// With `none`: the fixed bytes at the beginning are right, so this is a damaged telegram.
  bool began = false;
  bool bad_checksum = false;  ///< with `none`: only the check value is wrong
  bool other = false;  ///< with `whole`: the telegram names another device, or repeats something
                       ///< that was not sent
  std::size_t size = 0;
  std::vector<View> parts{};  ///< by element; views of the matched bytes

  /// Returns the bytes of the field; empty if the pattern has no such field.
  View Of(const Pattern& pattern, std::string_view name) const;
};

/// Matches at the front of `held`. `idle`: no more bytes follow. `most`: the longest telegram.
Match MatchFront(const Form& form, View held, bool idle, std::size_t most, const Bound& known);
/// Matches all of `bytes`, or nothing.
Match MatchAll(const Form& form, View bytes, const Bound& known);

/// Returns the values of a match; a field without a valid number has an empty value.
Bound ValuesOf(const Form& form, const Match& match);

/// Builds the telegram. Fields without a value are as in `rest`, a match of the same form, or blank
/// if `rest` is null. An error names the field.
Result<Bytes> Build(const Form& form, const Bound& values, const Match* rest = nullptr);

}  // namespace baudgate::protocols::telegram
