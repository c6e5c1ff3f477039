// SPDX-License-Identifier: Apache-2.0
#include "protocols/set4tm/memory_read.h"

#include <algorithm>

namespace baudgate::protocols::set4tm {

MemoryRead::MemoryRead(const std::vector<Stretch>& stretches, std::size_t most, bool twice)
    : twice_(twice) {
  for (Stretch rest : stretches) {
    while (rest.count > 0) {
      const std::size_t count = std::min(rest.count, most);
      pieces_.push_back({rest.address, count});
      rest = {rest.address + count, rest.count - count};
    }
  }
  read_.resize(pieces_.size());
}

MemoryRead::Stretch MemoryRead::Next() const {
  const bool again = count_ >= pieces_.size();
  return pieces_[again ? 2 * pieces_.size() - 1 - count_ : count_];
}

void MemoryRead::OnPiece(View bytes) {
  const bool again = count_ >= pieces_.size();
  Bytes& piece = read_[again ? 2 * pieces_.size() - 1 - count_ : count_];
  differs_ = differs_ || (again && !std::ranges::equal(piece, bytes));
  piece.assign(bytes.begin(), bytes.end());
  done_ = ++count_ == (twice_ ? 2 : 1) * pieces_.size();
  if (!done_ || differs_) return;
  for (const Bytes& one : read_) Append(bytes_, one);
}

}  // namespace baudgate::protocols::set4tm
