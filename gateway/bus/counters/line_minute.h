// What the time of a line goes to, since the start and in the present minute. The use of an
// exchange is known when it ends; until then its time is held back. For
// gateway/bus/counters/line_account.h.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <optional>
#include <utility>

#include "gateway/base/time.h"
#include "gateway/bus/points/line_use.h"

namespace baudgate {

class LineMinute {
 public:
  /// Parts of a minute, each 0 to 1.
  struct Use {
    double busy = 0;
    LineShares shares{};  ///< of that, what is known
  };

  /// The port was opened: no exchange is under way, and a minute begins.
  void OnOpened(Instant now) {
    exchange_ = {};
    full_.reset();
    Begin(now);
  }
  void OnClosed() { full_ = Use{}; }
  /// Behind what has been told of the time up to now.
  void OnTime(Instant now) {
    if (now - began_ < kMinute) return;
    full_ = UseAt(now);
    Begin(now);
  }
  void OnExchangeTime(Duration passed) {
    exchange_ += passed;
    busy_ += passed;
  }
  void OnDrained(Duration passed) {
    Of(LineUse::drains) += passed;
    busy_ += passed;
  }
  void OnEnd(LineUse use) { Of(use) += std::exchange(exchange_, {}); }

  const TimeByUse& spent() const { return spent_; }
  /// The last full minute; before there is one, the time since the opening.
  Use use(Instant now) const { return full_ ? *full_ : UseAt(now); }

 private:
  static constexpr Duration kMinute = std::chrono::minutes(1);
  /// Before this time the use is not shown.
  static constexpr Duration kShortest = std::chrono::seconds(10);

  /// The exchange under way goes on.
  void Begin(Instant now) {
    began_ = now;
    before_ = spent_;
    busy_ = {};
  }
  Use UseAt(Instant now) const {
    const Duration whole = now - began_;
    if (whole < kShortest) return {};
    const auto part = [whole](Duration of) {
      return static_cast<double>(of.count()) / static_cast<double>(whole.count());
    };
    Use use{.busy = part(busy_)};
    for (std::size_t i = 0; i < kLineUses; ++i) use.shares[i] = part(spent_[i] - before_[i]);
    return use;
  }
  Duration& Of(LineUse use) { return spent_[static_cast<std::size_t>(use)]; }

  TimeByUse spent_{};
  TimeByUse before_{};  // the minute
  Duration busy_{};     // of the minute
  Duration exchange_{};
  Instant began_{};          // the minute
  std::optional<Use> full_;  // the last full minute
};

}  // namespace baudgate
