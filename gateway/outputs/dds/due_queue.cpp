// SPDX-License-Identifier: Apache-2.0
#include "gateway/outputs/dds/due_queue.h"

#include <numeric>
#include <utility>

namespace baudgate::dds {

DueQueue::DueQueue(std::size_t count, Instant first)
    : due_(count, first), key_(count, first), heap_(count), position_(count) {
  std::iota(heap_.begin(), heap_.end(), 0U);
  std::iota(position_.begin(), position_.end(), 0U);
}

void DueQueue::Set(std::uint32_t slot, Instant due) {
  due_[slot] = due;
  if (due >= key_[slot]) return;
  key_[slot] = due;
  SiftUp(position_[slot]);
}

std::optional<std::uint32_t> DueQueue::Due(Instant now) {
  while (!heap_.empty()) {
    const std::uint32_t top = heap_.front();
    if (key_[top] > now) return std::nullopt;
    if (due_[top] <= now) return top;
    key_[top] = due_[top];
    SiftDown(0);
  }
  return std::nullopt;
}

Instant DueQueue::Next() const { return heap_.empty() ? Instant::max() : key_[heap_.front()]; }

void DueQueue::SiftUp(std::size_t at) {
  while (at > 0 && Before(at, (at - 1) / 2)) {
    Swap(at, (at - 1) / 2);
    at = (at - 1) / 2;
  }
}

void DueQueue::SiftDown(std::size_t at) {
  for (;;) {
    std::size_t least = at;
    for (const std::size_t child : {2 * at + 1, 2 * at + 2}) {
      if (child < heap_.size() && Before(child, least)) least = child;
    }
    if (least == at) return;
    Swap(at, least);
    at = least;
  }
}

void DueQueue::Swap(std::size_t a, std::size_t b) {
  std::swap(heap_[a], heap_[b]);
  position_[heap_[a]] = static_cast<std::uint32_t>(a);
  position_[heap_[b]] = static_cast<std::uint32_t>(b);
}

}  // namespace baudgate::dds
