// The broadcast by which all meters of a line keep the values of one moment, so that they can be
// added up; and how it is known that a meter has heard it, for none answers.
//
//   > FE 03 08 55 AA 33 CC C0 74     to all: keep powers, voltages, energies and the time
//   > 05 08 14 50 8E 16              when did you do that last?
//   < 05 00 00 12 02 01 09 02 EF DE  seven bytes, others than before the broadcast: it has heard it
//
// Source: set-4tm reference, 9.1, 9.5 and 10. What the seven bytes mean is not looked at.
//
// LatchedReads is one meter's part in the broadcast.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>

#include "gateway/base/bytes.h"
#include "gateway/base/time.h"
#include "protocols/protocol.h"
#include "protocols/set4tm/meter/point_reads.h"

namespace baudgate::protocols::set4tm {

/// The PDU that latches.
Bytes LatchPdu();
bool IsLatch(View pdu);
/// The PDU that asks for the time of the latest latch.
Bytes AskLatchTime();
/// Whether what the request reads was latched: 08 14, 08 1B 01, 08 1B 03, 08 23 nn 01.
bool ReadsLatched(View pdu);

/// When the broadcast of one line is due: at whole multiples of a period since 1970 by this
/// machine's clock.
class LineLatch {
 public:
  /// What this machine's clock shows. Before the first call nothing is due.
  void OnClock(Now now);
  std::optional<Instant> DueAt(Duration period) const;
  /// OnClock was called with the moment at which its last byte arrives.
  void OnSent();

  /// How many were sent.
  unsigned number() const { return number_; }
  /// When the latest was.
  WallTime sent_at() const { return base_.wall; }

 private:
  std::optional<Now> clock_;  // latest
  Now base_{};                // of the latest broadcast; before it, of the first OnClock
  unsigned number_ = 0;
};

/// What the meters of a line share.
struct MeterBus final : Bus {
  LineLatch latch;
};

/// One meter: whether what it has latched is of the line's latest broadcast. It is asked for its
/// time once before a broadcast and once behind each. `number`: of the broadcasts so far.
class MeterLatch {
 public:
  bool WantsTime(unsigned number) const { return !refused_ && (asked_ != number || doubted_); }
  /// It has told what there is to tell of this broadcast.
  bool Told(unsigned number) const { return asked_ == number; }
  void OnTime(View time, unsigned number);
  /// It was silent: it may have been without power, and has to tell once more.
  void Doubt() { doubted_ = true; }
  /// It did not answer.
  void OnFailure(unsigned number);
  /// It does not tell.
  void OnRefused() { refused_ = true; }
  void ForgetRefusals() { refused_ = false; }
  bool refused() const { return refused_; }
  /// It has heard the latest, and nobody else's since.
  bool Heard(unsigned number) const { return heard_ && asked_ == number && !doubted_; }
  /// It is known that it has not.
  bool Missed(unsigned number) const { return missed_ && asked_ == number; }
  /// Another meter may answer now.
  void Forget() { *this = {}; }

 private:
  std::optional<unsigned> asked_;  // after so many broadcasts
  std::optional<Bytes> time_;      // what it said then
  bool heard_ = false;
  bool missed_ = false;
  bool doubted_ = false;
  bool refused_ = false;
};

// One meter's part in the broadcast latch of its line: when the broadcast is sent, and
// what is made of the values behind it.
//
//   FE 03 08 55 AA 33 CC   due, and the line is free
//   05 08 14 50            other bytes than before: heard
//   05 08 1B 03 00         good; of a meter that has not heard it: waiting, without a value
//
// From the reply to 08 14 50 on no value of the latch before is shown any more: all that is latched
// waits, and is read again at once. Otherwise a value of 12:00 would stand beside one of 12:15.
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
