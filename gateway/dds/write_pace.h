// When the next sample may be written: at a pace that loses none on the way, and after a rest when
// the receiver had no room. Time is an argument.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>

#include "gateway/base/time.h"
#include "gateway/dds/pacer.h"
#include "gateway/dds/sample_writer.h"

namespace baudgate::dds {

class WritePace {
 public:
  explicit WritePace(Pacer pacer) : pacer_(pacer) {}

  /// The next sample may be written now.
  bool MayWrite(Instant now) { return now >= held_until_ && pacer_.Take(now); }
  /// Takes the writer's answer. False: write the same sample again later, after a pause of 1, 2, 4,
  /// 8, 10, 10 … ms.
  bool Took(Sent said, Instant now);
  Instant ReadyAt() const { return std::max(held_until_, pacer_.ReadyAt()); }
  /// There is a new receiver.
  void ForgetHold() { held_until_ = {}; }

  static constexpr Duration kLongestHold = 10ms;

 private:
  Pacer pacer_;
  Instant held_until_{};
  Duration hold_{};  ///< doubles while there is no room
};

}  // namespace baudgate::dds
