// Whether something that may happen once by chance happens again and again: it has begun when it
// happened three times within a minute, and ended after a minute without it.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <utility>

#include "gateway/base/time.h"

namespace baudgate {

class Burst {
 public:
  static constexpr int kCount = 3;
  static constexpr Duration kTime = 1min;

  /// It happened. True: the burst has begun.
  bool Add(Instant now) {
    if (count_ == 0 || now - last_ >= kTime) count_ = 0;
    last_ = now;
    return ++count_ >= kCount && !std::exchange(going_on_, true);
  }
  /// True: the burst has ended.
  bool EndsAt(Instant now) { return going_on_ && now - last_ >= kTime && !(going_on_ = false); }

 private:
  int count_ = 0;  // less than a minute apart each
  Instant last_{};
  bool going_on_ = false;
};

}  // namespace baudgate
