// Many entries of one point as few bytes, and back: columns of differences, then zlib.
//
//   byte 0, 1, 2   version (1), ValueCode, decimals
//   number         bytes of what follows before zlib
//   zlib over      count, time of the first, then how each step in time differs from the one before
//                  qualities: how many, which, …
//                  how many have a value, how many have none, how many have one again, …
//                  values of those that have one
//
// Numbers: 7 bits a byte, low ones first; signed ones by ZigZag. docs/history.md.
//
// ColumnWriter and ColumnReader handle numbers, and WriteValues and ReadValues the column of
// values.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "gateway/base/bytes.h"
#include "gateway/base/value.h"
#include "gateway/records/history/batch.h"

namespace baudgate::history {

// Numbers as few bytes: the columns of a chunk. Reading is bounded by the bytes that are there.

/// 0, -1, 1, -2 … as 0, 1, 2, 3 …: small numbers of either sign are short.
constexpr std::uint64_t ZigZag(std::int64_t number) {
  return static_cast<std::uint64_t>(number) << 1U ^ static_cast<std::uint64_t>(number >> 63U);
}
constexpr std::int64_t UnZigZag(std::uint64_t code) {
  return static_cast<std::int64_t>(code >> 1U ^ (~(code & 1U) + 1U));
}
/// Over both ends of the range, as differences that are added again need it.
constexpr std::int64_t WrapSub(std::int64_t a, std::int64_t b) {
  return static_cast<std::int64_t>(static_cast<std::uint64_t>(a) - static_cast<std::uint64_t>(b));
}
constexpr std::int64_t WrapAdd(std::int64_t a, std::int64_t b) {
  return static_cast<std::int64_t>(static_cast<std::uint64_t>(a) + static_cast<std::uint64_t>(b));
}

class ColumnWriter {
 public:
  void Unsigned(std::uint64_t number);
  void Signed(std::int64_t number) { Unsigned(ZigZag(number)); }
  void Text(const std::string& text);
  const Bytes& bytes() const { return bytes_; }

 private:
  Bytes bytes_;
};

/// After the first thing that is not there, nothing is.
class ColumnReader {
 public:
  explicit ColumnReader(View bytes) : rest_(bytes) {}

  std::uint64_t Unsigned();
  std::int64_t Signed() { return UnZigZag(Unsigned()); }
  std::string Text();
  bool ok() const { return ok_; }
  void Fail() { ok_ = false; }
  bool at_end() const { return rest_.empty(); }

 private:
  View rest_;
  bool ok_ = true;
};

// The values of a chunk, each differently by what they are: the numbers that are users' end in the
// docs (docs/history.md); new ones are appended.
enum class ValueCode : std::uint8_t {
  none = 0,     ///< there are none
  whole = 1,    ///< signed: difference to the one before
  counter = 2,  ///< unsigned: difference to the one before
  flag = 3,     ///< 0 or 1
  divided = 4,  ///< number = whole / 10^decimals; differences as of whole
  scaled = 5,   ///< number = whole * 10^-decimals
  single = 6,   ///< differences of the 32 bits of a float
  real = 7,     ///< differences of the 64 bits of a double
  text = 8,     ///< length and bytes
  mixed = 9,    ///< each with the code of its own kind
};

struct ValueForm {
  ValueCode code = ValueCode::none;
  std::uint8_t decimals = 0;
};

/// The shortest that brings back exactly these. All of them are values.
ValueForm FormOf(std::span<const Value> values);

/// More are never in one.
inline constexpr std::size_t kMostInChunk = 20'000;
/// Longer texts are cut before they come here.
inline constexpr std::size_t kLongestText = 250;

/// At most kMostInChunk, with times that rise from each to the next, from 1 on. Empty: no memory.
Bytes EncodeChunk(std::span<const Entry> entries);
/// Exactly what was encoded. Empty: these bytes are no chunk.
std::optional<std::vector<Entry>> DecodeChunk(View bytes);

}  // namespace baudgate::history
