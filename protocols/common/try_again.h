// When something that a device has refused is tried again: soon, because it may have only just
// started up, and less and less often if it goes on refusing it.
//
//   refused at 0 s    tried and refused at 8 s, 24 s, 56 s …, at last once an hour
//
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <optional>

#include "gateway/base/time.h"

namespace baudgate {

class TryAgain {
 public:
  static constexpr Duration kLongest = 1h;

  /// `first`: the first wait.
  explicit TryAgain(Duration first = 8s) : first_(first) {}

  /// It was refused: starts the first wait, or one twice as long as the last (at most kLongest).
  /// Does nothing while a wait is running.
  void OnRefused(Instant now) {
    if (at_ && now < *at_) return;
    wait_ = wait_ == Duration::zero() ? first_ : std::min(2 * wait_, kLongest);
    at_ = now + wait_;
  }
  /// The wait is over.
  bool IsDue(Instant now) const { return at_ && now >= *at_; }
  /// Like IsDue, but true only once: it also ends the wait.
  bool TakeDue(Instant now) {
    if (!IsDue(now)) return false;
    at_.reset();
    return true;
  }
  /// It works again, or nothing is known of it any more.
  void Forget() { *this = TryAgain(first_); }

 private:
  Duration first_;
  Duration wait_{};              // the latest
  std::optional<Instant> at_{};  // its end; empty: none is under way
};

}  // namespace baudgate
