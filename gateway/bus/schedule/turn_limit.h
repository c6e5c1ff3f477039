// Turns of a line that take no time. A handful at one moment is usual. Without an end they would
// hang the thread of the line, so after very many the line rests. A part of
// gateway/bus/jobs/turn_taker.h.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>

#include "gateway/base/time.h"

namespace baudgate {

class TurnLimit {
 public:
  /// At one moment. All polls of a line that cannot be asked are far fewer.
  static constexpr int kMost = 20'000;
  static constexpr Duration kRest = 1s;
  static constexpr Duration kTellAgain = 1h;
  static constexpr const char* kWarning =
      "its line takes turns without end and without time, and rests for 1 s after each 20000: this "
      "is an error of the gateway or of a protocol's plugin";

  /// rest_and_tell: kWarning is due.
  enum class Turn : std::uint8_t { take, rest, rest_and_tell };
  Turn Take(Instant now) {
    if (now < rests_until_) return Turn::rest;
    if (now != moment_) taken_ = 0;
    moment_ = now;
    if (++taken_ <= kMost) return Turn::take;
    rests_until_ = now + kRest;
    if (now < told_until_) return Turn::rest;
    told_until_ = now + kTellAgain;
    return Turn::rest_and_tell;
  }
  /// Empty: it does not rest.
  std::optional<Instant> RestsUntil(Instant now) const {
    return now < rests_until_ ? std::optional(rests_until_) : std::nullopt;
  }

 private:
  Instant moment_{};
  int taken_ = 0;
  Instant rests_until_{};
  Instant told_until_{};
};

}  // namespace baudgate
