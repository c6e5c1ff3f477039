// What the time of a line goes to, in the minute under way. The use of an exchange is known when it
// ends; until then its time is held back. For gateway/poll/ledger.h.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <utility>

#include "gateway/base/time.h"
#include "gateway/store/line_use.h"

namespace baudgate {

class LineMinute {
 public:
  void Reset() { *this = {}; }
  /// A new minute begins; the exchange under way goes on.
  void Begin() { spent_ = {}; }
  void OnExchangeTime(Duration passed) { exchange_ += passed; }
  void OnDrained(Duration passed) { Of(LineUse::drains) += passed; }
  void OnEnd(LineUse use) { Of(use) += std::exchange(exchange_, {}); }

  /// Parts of `whole`, which is not zero.
  LineShares SharesOf(Duration whole) const {
    LineShares shares{};
    for (std::size_t i = 0; i < kLineUses; ++i) {
      shares[i] = static_cast<double>(spent_[i].count()) / static_cast<double>(whole.count());
    }
    return shares;
  }

 private:
  Duration& Of(LineUse use) { return spent_[static_cast<std::size_t>(use)]; }

  std::array<Duration, kLineUses> spent_{};
  Duration exchange_{};
};

}  // namespace baudgate
