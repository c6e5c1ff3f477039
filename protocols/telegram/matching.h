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
  const ChecksumKind* kind = nullptr;  ///< the algorithm; null: the telegram has no check value
  std::size_t skip = 0;
  std::size_t leave = 0;

  /// Computes the check value. `front`: all bytes in front of the field. Returns nothing if they
  /// are too few.
  std::optional<std::uint32_t> Of(View front) const;
};

/// The values of fields that are known beforehand: address, parameters, fields that were sent.
using Bound = std::map<std::string, Value, std::less<>>;

/// A field that contains the size of the telegram. Its content plus `plus` is the number of bytes.
struct SizeField {
  std::size_t at = 0;
  Format format{};
  std::size_t plus = 0;
};

struct Form {
  Pattern pattern;
  Checksum checksum;
  std::optional<SizeField> size_at;
  bool is_answer = false;  ///< true: the telegram is an answer to a telegram that was sent

  /// True for an answer without a check value that begins with fixed bytes and has at most two of
  /// them, such as the byte ACK: many damaged telegrams contain these bytes.
  bool is_scant() const {
    constexpr std::size_t kFewBytes = 2;
    return is_answer && checksum.kind == nullptr && !pattern.elements.front().is_field() &&
           pattern.literal_size() <= kFewBytes;
  }
  /// True if a telegram of this form could be found inside another, damaged telegram, because the
  /// form has no check value, and begins with a field or is scant. A telegram of this form is
  /// accepted only at the beginning of the received bytes (protocols/telegram/rules.cpp), and only
  /// up to half of the longest size.
  bool is_unmarked() const {
    return (checksum.kind == nullptr && pattern.elements.front().is_field()) || is_scant();
  }
  /// True if no fixed bytes end an unmarked telegram, so only silence ends it. If bytes follow
  /// without a pause, bytes were lost, and those in the place of the telegram belong to another
  /// one.
  bool ends_with_silence() const { return is_unmarked() && pattern.elements.back().is_field(); }
};

struct Match {
  enum class Kind : std::uint8_t {
    none,       ///< the bytes are not such a telegram, whatever bytes follow
    need_more,  ///< the bytes can become such a telegram
    whole,
  } kind = Kind::none;
  /// For `none`: true if the fixed bytes at the beginning are right, so this is a damaged telegram.
  bool began = false;
  bool bad_checksum = false;  ///< for `none`: true if only the check value is wrong
  /// For `whole`: true if the telegram names another device, or repeats a value that was not sent.
  bool other = false;
  std::size_t size = 0;
  std::vector<View> parts{};  ///< the bytes of each element, as views of the matched bytes

  View Of(const Pattern& pattern, std::string_view name) const;
};

/// Matches the bytes at the front of `held`. `idle`: true if no more bytes follow. `most`: the
/// length of the longest telegram. `known`: values that fields must have; other values set
/// Match::other.
Match MatchFront(const Form& form, View held, bool idle, std::size_t most, const Bound& known);
/// Matches all of `bytes`; no match if bytes are left over.
Match MatchAll(const Form& form, View bytes, const Bound& known);

/// Returns the values of the fields of a match. A field without a valid number has an empty value.
Bound ValuesOf(const Form& form, const Match& match);

/// Builds a telegram. Fields without a value are taken from `rest`, a match of the same form, or
/// are blank if `rest` is null. The error names the field.
Result<Bytes> Build(const Form& form, const Bound& values, const Match* rest = nullptr);

}  // namespace baudgate::protocols::telegram
