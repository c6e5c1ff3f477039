// One meter's part in the broadcast latch of its line (latch.h): when the broadcast is sent, and
// what is made of the values behind it.
//
//   FE 03 08 55 AA 33 CC   due, and the line is free
//   05 08 14 50            other bytes than before: heard
//   05 08 1B 03 00         good; of a meter that has not heard it: waiting, without a value
//
// From the reply to 08 14 50 on no value of the latch before is shown any more: all that is latched
// waits, and is read again at once. Otherwise a value of 12:00 would stand beside one of 12:15.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>

#include "gateway/base/time.h"
#include "protocols/set4tm/latch.h"
#include "protocols/set4tm/point_reads.h"
#include "protocols/set4tm/reply.h"

namespace baudgate::protocols::set4tm {

class LatchedReads {
 public:
  /// `period`: how often all meters of the line are told to latch; zero: never. `line` outlives it.
  LatchedReads(Duration period, LineLatch& line) : period_(period), line_(line) {}

  /// The broadcast is to be sent before anything else.
  bool IsDue(Instant now) const;
  /// When the broadcast or the question for its time is due next; empty: never.
  std::optional<Instant> DueAt() const;
  /// The meter tells when it has latched.
  bool tells() const { return period_ != Duration::zero() && !meter_.refused(); }
  /// It is to be asked for that before the next latched value is read.
  bool WantsTime() const { return tells() && meter_.WantsTime(line_.number()); }

  void OnClock(Now arrives) { line_.OnClock(arrives); }
  void OnSent() { line_.OnSent(); }
  /// A request was sent and not answered; `asked`: what it was.
  void OnFailure(View asked);
  void OnRefused() { meter_.OnRefused(); }
  void ForgetRefusals() { meter_.ForgetRefusals(); }
  void OnReconnect() { meter_.Forget(); }

  /// What the reply says of the latch, and of the latched values that it brings.
  void Take(Reply& reply, const PointReads& reads);
  /// For the status; empty: nothing was learned.
  std::string Learned() const;

 private:
  /// What was read of the latch before, but for what `answer` brings itself.
  static void Drop(Answer& answer, const PointReads& reads);

  const Duration period_;
  LineLatch& line_;
  MeterLatch meter_;
};

}  // namespace baudgate::protocols::set4tm
