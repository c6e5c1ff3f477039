// Does a device answer late, or does something in between let each reply go when the next request
// comes? In the second case its replies come right behind the next requests, at all kinds of times
// after their own. A part of gateway/diagnosis/damage/reply_habits.h.
//
//   behind its request       behind the next one    it lags
//   620 ms                   not soon               no
//   900, 1400, 700 ms        12 ms                  no: three may be chance
//   900, 1400, 700, 950 ms   12 ms                  yes
//   900, 900, 900, 950 ms    12, 12, 13, 12 ms      yes
//   900, 910, 905, 900 ms    12, 22, 17, 12 ms      no: it is always as late
//
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cstddef>
#include <optional>

#include "gateway/base/time.h"

namespace baudgate {

class ReplyLag {
 public:
  /// A late reply came `after` its request and so soon behind the `next` one; empty: not soon.
  /// True: it lags.
  bool OnLate(Duration after, std::optional<Duration> next) {
    if (!next) {
      count_ = 0;
      return false;
    }
    if (count_++ == 0) after_ = next_ = {};
    after_.Add(after);
    next_.Add(*next);
    return count_ >= kNoChance && after_.Spread() >= std::max(kSpread, kWider * next_.Spread());
  }

 private:
  static constexpr std::size_t kNoChance = 4;
  static constexpr Duration kSpread = 20ms;
  static constexpr int kWider = 4;

  struct Range {
    void Add(Duration time) {
      least = std::min(least, time);
      most = std::max(most, time);
    }
    Duration Spread() const { return most - least; }

    Duration least = Duration::max();
    Duration most{};
  };

  std::size_t count_ = 0;  // in a row
  Range after_;
  Range next_;
};

}  // namespace baudgate
