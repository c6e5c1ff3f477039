// When a lost port is tried again: at once where its device file has just appeared, else in growing
// steps with jitter, so that many lines behind one dead server do not knock in step. The sixth of
// the named times. Time is an argument.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cstdint>
#include <random>

#include "gateway/base/time.h"

namespace baudgate {

class ReopenLadder {
 public:
  static constexpr Duration kFirst = 500ms;
  static constexpr Duration kLast = 30s;

  explicit ReopenLadder(std::uint32_t seed) : random_(seed) {}

  /// The wait before the next try: 0.5 s, 1 s, 2 s … 30 s, each 10 % shorter or longer at random.
  Duration Next() {
    const Duration step = next_;
    next_ = std::min(2 * next_, kLast);
    std::uniform_real_distribution<double> jitter(0.9, 1.1);
    return Duration(static_cast<std::int64_t>(static_cast<double>(step.count()) * jitter(random_)));
  }
  /// The port has worked, or its file has appeared again.
  void Reset() { next_ = kFirst; }

 private:
  std::minstd_rand random_;
  Duration next_ = kFirst;
};

}  // namespace baudgate
