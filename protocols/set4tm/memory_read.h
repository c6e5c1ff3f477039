// Stretches of a meter's memory, read piece by piece, no piece longer than a reply of it can be.
// Where replies do not say to which request they belong, all is read twice, the second time from
// the last piece to the first, and counts only if both are alike.
//
//   {0658, 24} in pieces of 16      0658 16 · 0668 8      and again: 0668 8 · 0658 16
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "gateway/base/bytes.h"

namespace baudgate::protocols::set4tm {

class MemoryRead {
 public:
  struct Stretch {
    std::size_t address = 0;
    std::size_t count = 0;
  };
  /// `most`: bytes of a piece.
  MemoryRead(const std::vector<Stretch>& stretches, std::size_t most, bool twice);

  /// While it is not done.
  Stretch Next() const;
  /// The bytes of Next.
  void OnPiece(View bytes);
  bool done() const { return done_; }
  /// When done, one stretch behind the other; empty: the two readings differ.
  const Bytes& bytes() const { return bytes_; }

 private:
  std::vector<Stretch> pieces_;
  const bool twice_;
  std::vector<Bytes> read_;  // by piece
  std::size_t count_ = 0;    // pieces that were read, of both passes
  bool differs_ = false;
  bool done_ = false;
  Bytes bytes_;
};

}  // namespace baudgate::protocols::set4tm
