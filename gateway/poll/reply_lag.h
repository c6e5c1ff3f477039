// Does a device answer late, or does something in between let each reply go when the next request
// comes? In the second case its replies come right behind the next requests, at all kinds of times
// after their own. A part of gateway/poll/examiner.h.
//
//   behind its request    right behind the next one    it lags
//   620 ms                no                           no
//   900, 1400, 700 ms     yes, yes, yes                no: three may be chance
//   900, 1400, 700, 950   yes, all four                yes
//   900, 910, 905, 900    yes, all four                no: it is always as late
//
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cstddef>

#include "gateway/base/time.h"

namespace baudgate {

class ReplyLag {
 public:
  /// A late reply came `after` its request; `soon`: right behind the next one. True: it lags.
  bool OnLate(Duration after, bool soon) {
    if (!soon) {
      count_ = 0;
      return false;
    }
    least_ = count_ == 0 ? after : std::min(least_, after);
    most_ = count_ == 0 ? after : std::max(most_, after);
    ++count_;
    return count_ >= kNoChance && most_ - least_ >= kSpread;
  }

 private:
  static constexpr std::size_t kNoChance = 4;
  static constexpr Duration kSpread = 100ms;

  std::size_t count_ = 0;  // in a row
  Duration least_{};
  Duration most_{};
};

}  // namespace baudgate
