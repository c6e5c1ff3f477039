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
  /// How often since then, at most kKept.
  std::size_t Since(Instant when) const {
    const auto end = times_.begin() + static_cast<std::ptrdiff_t>(std::min(count_, kKept));
    return static_cast<std::size_t>(
        std::count_if(times_.begin(), end, [when](Instant one) { return one >= when; }));
  }

 private:
  std::array<Instant, kKept> times_{};
  std::size_t count_ = 0;
};

}  // namespace baudgate
