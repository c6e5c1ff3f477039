// The latest runs of unanswered exchanges of a device between answered ones, and when they were:
// single losses are cured by a retry, an outage strikes whatever is asked while it lasts. An answer
// that is damaged or does not fit is neither. Bounded memory.
//
//   o x x x o o o o x x . .     runs: 3 failed behind 1 answered, 2 failed behind 4 (not over yet)
//
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "gateway/base/time.h"

namespace baudgate {

class FailureRuns {
 public:
  struct Run {
    std::uint32_t answered = 0;       ///< in a row in front of it
    std::uint32_t failed = 0;         ///< in a row
    std::optional<Instant> before{};  ///< when the last answer in front of it came
    Instant first{};                  ///< when the first failure had ended, and the last
    Instant last{};
    std::optional<Instant> after{};  ///< when the next answer came; nothing: it is not over yet
  };
  static constexpr std::size_t kKept = 16;
  /// An older one is forgotten, once so many exchanges have come behind it.
  static constexpr Duration kRecent = 5min;
  static constexpr std::uint32_t kExchanges = 32;

  void Add(bool answered, Instant ended) {
    answered ? OnAnswered(ended) : OnFailed(ended);
    Forget(ended);
  }

  /// The oldest first.
  const std::vector<Run>& runs() const { return runs_; }
  /// Exchanges in a row that were answered since the last run.
  std::uint32_t answered() const { return answered_; }

 private:
  void OnAnswered(Instant ended) {
    if (!runs_.empty() && !runs_.back().after) runs_.back().after = ended;
    ++answered_;
    answered_at_ = ended;
  }
  void OnFailed(Instant ended) {
    if (runs_.empty() || runs_.back().after) {
      runs_.push_back({.answered = answered_, .before = answered_at_, .first = ended});
      answered_ = 0;
    }
    ++runs_.back().failed;
    runs_.back().last = ended;
  }
  void Forget(Instant now) {
    std::uint32_t behind = answered_;
    for (const Run& run : runs_) behind += run.answered + run.failed;
    while (!runs_.empty() && runs_.front().after) {
      behind -= runs_.front().answered + runs_.front().failed;
      const bool old = now - *runs_.front().after > kRecent && behind >= kExchanges;
      if (!old && runs_.size() <= kKept) return;
      runs_.erase(runs_.begin());
    }
  }

  std::vector<Run> runs_;
  std::uint32_t answered_ = 0;
  std::optional<Instant> answered_at_;
};

}  // namespace baudgate
