// Which of many numbered things is due next: an indexed heap in which putting something off, the
// common case, costs one store. Pure; used by gateway/outputs/dds/publish_plan.h for points and
// devices.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <vector>

#include "gateway/base/time.h"

namespace baudgate::dds {

class DueQueue {
 public:
  /// Slots 0…count-1, all due at `first`.
  DueQueue(std::size_t count, Instant first);

  /// Earlier takes O(log n) at once; later is noted and settled when the old time comes.
  void Set(std::uint32_t slot, Instant due);
  Instant due(std::uint32_t slot) const { return due_[slot]; }

  /// A slot whose time has come, if any. It stays in the queue: Set it to its next time.
  std::optional<std::uint32_t> Due(Instant now);
  /// Not later than the next due time; Instant::max() when there are no slots.
  Instant Next() const;

 private:
  void SiftUp(std::size_t at);
  void SiftDown(std::size_t at);
  bool Before(std::size_t a, std::size_t b) const { return key_[heap_[a]] < key_[heap_[b]]; }
  void Swap(std::size_t a, std::size_t b);

  std::vector<Instant> due_;             ///< by slot
  std::vector<Instant> key_;             ///< by slot: what the heap is ordered by; never after due_
  std::vector<std::uint32_t> heap_;      ///< slots
  std::vector<std::uint32_t> position_;  ///< by slot: where it stands in heap_
};

}  // namespace baudgate::dds
