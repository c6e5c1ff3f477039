// When something happened, the latest times. Bounded memory.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>

#include "gateway/base/time.h"

namespace baudgate {

class RecentTimes {
 public:
  static constexpr std::size_t kKept = 64;

  void Add(Instant when) { times_[count_++ % kKept] = when; }
  /// How often since then, at most kKept. What comes sooner than `apart` behind one that counts is
  /// the same trouble.
  std::size_t Since(Instant when, Duration apart = {}) const {
    std::size_t found = 0;
    Instant counted{};
    for (std::size_t i = count_ - std::min(count_, kKept); i < count_; ++i) {
      const Instant one = times_[i % kKept];
      if (one < when || (found > 0 && one - counted < apart)) continue;
      counted = one;
      ++found;
    }
    return found;
  }

 private:
  std::array<Instant, kKept> times_{};
  std::size_t count_ = 0;
};

}  // namespace baudgate
