// Numbers as few bytes: the columns of a chunk. Reading is bounded by the bytes that are there.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "gateway/base/bytes.h"

namespace baudgate::history {

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

}  // namespace baudgate::history
