// Bounded queue of batches that wait while the disk is slow, full or failing. No lock:
// gateway/records/history/history_log.h has it.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cstddef>
#include <utility>

#include "gateway/records/history/batch.h"

namespace baudgate::history {

class BatchQueue {
 public:
  /// `most` samples, and as many spans.
  explicit BatchQueue(std::size_t most) : most_(most) {}

  /// So many samples fit in.
  std::size_t Room() const { return most_ - std::min(most_, waiting_.samples.size()); }
  /// With at most so many samples. Spans have places of their own: there are few, and they are
  /// worth more. Returns how many were dropped.
  std::size_t Add(Batch&& batch) {
    std::size_t dropped = 0;
    if (waiting_.trends.size() + batch.trends.size() > most_) {
      dropped = batch.trends.size();
      batch.trends.clear();
    }
    waiting_.Append(std::move(batch));
    return dropped;
  }
  Batch TakeAll() { return std::exchange(waiting_, {}); }
  std::size_t samples() const { return waiting_.samples.size(); }

 private:
  const std::size_t most_;
  Batch waiting_;
};

}  // namespace baudgate::history
