// When the thread that writes events is due again. A part of gateway/records/events/event_rounds.h.
//
//   the disk           there is work          there is none
//   fails              after a rest           after a rest
//   works              at once                at the time of a look, or of what was left out
//
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <optional>

#include "gateway/base/time.h"
#include "gateway/base/worker.h"

namespace baudgate::events {

class RoundTimer {
 public:
  /// A round is due then, or earlier.
  void Look(Instant at) { look_at_ = look_at_ ? std::min(*look_at_, at) : at; }
  /// The disk has failed, and is left in peace until then.
  void Rest(Instant until) { rests_until_ = until; }
  /// It has begun.
  void Begin() { look_at_.reset(); }
  /// `left_out_at`: when events that were left out are to be told.
  Instant At(bool fails, bool idle, std::optional<Instant> left_out_at) const {
    if (fails) return rests_until_;
    if (!idle) return {};
    return std::min(left_out_at.value_or(kWhenWoken), look_at_.value_or(kWhenWoken));
  }

 private:
  std::optional<Instant> look_at_;
  Instant rests_until_{};
};

}  // namespace baudgate::events
