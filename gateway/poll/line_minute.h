// What the time of a line goes to, since the start and in the minute under way. The use of an
// exchange is known when it ends; until then its time is held back. For gateway/poll/ledger.h.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <utility>

#include "gateway/base/time.h"
#include "gateway/store/line_use.h"

namespace baudgate {

class LineMinute {
 public:
  /// The port was opened: nothing is under way, and a minute begins.
  void Reset() {
    exchange_ = {};
    Begin();
  }
  /// A new minute begins; the exchange under way goes on.
  void Begin() { before_ = spent_; }
  void OnExchangeTime(Duration passed) { exchange_ += passed; }
  void OnDrained(Duration passed) { Of(LineUse::drains) += passed; }
  void OnEnd(LineUse use) { Of(use) += std::exchange(exchange_, {}); }

  const TimeByUse& spent() const { return spent_; }
  /// Parts of `whole`, which is not zero.
  LineShares SharesOf(Duration whole) const {
    LineShares shares{};
    for (std::size_t i = 0; i < kLineUses; ++i) {
      const Duration passed = spent_[i] - before_[i];
      shares[i] = static_cast<double>(passed.count()) / static_cast<double>(whole.count());
    }
    return shares;
  }

 private:
  Duration& Of(LineUse use) { return spent_[static_cast<std::size_t>(use)]; }

  TimeByUse spent_{};
  TimeByUse before_{};  // the minute
  Duration exchange_{};
};

}  // namespace baudgate
