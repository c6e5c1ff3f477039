// `EncodeChunk` compresses many entries of one point, and `DecodeChunk` restores them. A chunk
// contains columns of differences, compressed by zlib:
//
//   byte 0, 1, 2   version (1), ValueCode, decimals
//   number         size in bytes before the compression
//   zlib over      count, first time, first time step, then the change from each step to the next
//                  qualities as runs: count, quality, count, quality, …
//                  whether entries have a value, as runs: count, 0 or 1, …
//                  the values of the entries that have one
//
// Numbers: 7 bits a byte, low bits first; signed numbers by ZigZag. docs/history.md describes the
// format.
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

// `ColumnWriter` and `ColumnReader` write and read the columns of a chunk: numbers of variable
// length, and texts.

/// Maps 0, -1, 1, -2 … to 0, 1, 2, 3 …, so that small numbers of either sign are short.
constexpr std::uint64_t ZigZag(std::int64_t number) {
  return static_cast<std::uint64_t>(number) << 1U ^ static_cast<std::uint64_t>(number >> 63U);
}
constexpr std::int64_t UnZigZag(std::uint64_t code) {
  return static_cast<std::int64_t>(code >> 1U ^ (~(code & 1U) + 1U));
}
/// Subtracts with wrap-around: WrapAdd(WrapSub(a, b), b) is `a` for all values.
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

/// Reads numbers and texts, and never reads beyond the given bytes. After the first failure all
/// reads return 0 or an empty text, and ok() is false.
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

// The encoding of the values of a chunk, by their type. The numbers are stored in the files
// (docs/history.md), so new ones are appended.
enum class ValueCode : std::uint8_t {
  none = 0,     ///< the chunk contains no values
  whole = 1,    ///< signed: difference to the previous value
  counter = 2,  ///< unsigned: difference to the previous value
  flag = 3,     ///< 0 or 1
  divided = 4,  ///< number = whole / 10^decimals; difference of whole
  scaled = 5,   ///< number = whole * 10^-decimals; difference of whole
  single = 6,   ///< differences of the 32 bits of a float
  real = 7,     ///< differences of the 64 bits of a double
  text = 8,     ///< length and bytes
  mixed = 9,    ///< each value follows its ValueCode
};

struct ValueForm {
  ValueCode code = ValueCode::none;
  std::uint8_t decimals = 0;
};

/// Returns the shortest form that restores exactly these values. `values` must not contain an empty
/// value.
ValueForm FormOf(std::span<const Value> values);

inline constexpr std::size_t kMostInChunk = 20'000;
/// The limit of texts, in bytes. Callers of EncodeChunk cut longer texts.
inline constexpr std::size_t kLongestText = 250;

/// Encodes at most kMostInChunk entries; their times must be positive and increase. Returns no
/// bytes if memory is short.
Bytes EncodeChunk(std::span<const Entry> entries);
/// Returns exactly the encoded entries; nullopt if the bytes are not a valid chunk.
std::optional<std::vector<Entry>> DecodeChunk(View bytes);

}  // namespace baudgate::history
