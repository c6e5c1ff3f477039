// How fast something may go on. Time is an argument.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

#include "gateway/base/time.h"

namespace baudgate::dds {

/// Keeps bursts below what socket buffers hold (a burst that overflows them is lost and costs
/// seconds of retransmission): `burst` samples at once, then one every `interval`.
class Pacer {
 public:
  Pacer(Duration interval, std::uint32_t burst)
      : interval_(interval), allowance_(interval * burst) {}

  /// One sample may go now.
  bool Take(Instant now);
  /// When half a burst may go: waking for each single sample would cost more than sending it.
  Instant ReadyAt() const { return reserved_until_ - allowance_ / 2; }

 private:
  Duration interval_;
  Duration allowance_;
  Instant reserved_until_{};
};

}  // namespace baudgate::dds
