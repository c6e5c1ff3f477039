// The latch is a broadcast by which all meters of a line store their values of one moment, so that
// the values can be added up. No meter answers the broadcast, so each is asked later whether it has
// received it.
//
//   > FE 03 08 55 AA 33 CC C0 74     to all meters: store powers, voltages, energies and the time
//   > 05 08 14 50 8E 16              ask the time of the latest latch
//   < 05 00 00 12 02 01 09 02 EF DE  seven bytes; if they have changed, the broadcast was received
//
// Source: set-4tm reference, 9.1, 9.5 and 10. The meaning of the seven bytes is not used.
//
// LineLatch decides when the broadcast is sent; LatchedReads handles it for one meter.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>

#include "gateway/base/bytes.h"
#include "gateway/base/time.h"
#include "protocols/protocol.h"
#include "protocols/set4tm/meter/point_reads.h"

namespace baudgate::protocols::set4tm {

Bytes LatchPdu();
bool IsLatch(View pdu);
Bytes AskLatchTime();
/// True if the request reads latched values: 08 14, 08 1B 01, 08 1B 03, 08 23 nn 01.
bool ReadsLatched(View pdu);

/// Decides when a line's broadcast is due: at whole multiples of a period since 1970.
class LineLatch {
 public:
  /// Call with the time of this machine. Before the first call no broadcast is due.
  void OnClock(Now now);
  std::optional<Instant> DueAt(Duration period) const;
  /// Call when a broadcast was sent, after OnClock with the time at which its last byte arrives.
  void OnSent();

  unsigned number() const { return number_; }
  /// Time of the latest broadcast.
  WallTime sent_at() const { return base_.wall; }

 private:
  std::optional<Now> clock_;  // latest time of this machine
  Now base_{};                // time of the latest broadcast; before it, of the first OnClock
  unsigned number_ = 0;
};

struct MeterBus final : Bus {
  LineLatch latch;
};

/// Decides whether the latched values of one meter are of the latest broadcast. The meter is asked
/// once before a broadcast and once after each. `number`: broadcasts so far.
class MeterLatch {
 public:
  bool WantsTime(unsigned number) const { return !refused_ && (asked_ != number || doubted_); }
  /// True if the meter was asked after the latest broadcast.
  bool Told(unsigned number) const { return asked_ == number; }
  void OnTime(View time, unsigned number);
  /// Call if the meter was silent: it may have been without power, so it must be asked again.
  void Doubt() { doubted_ = true; }
  /// Call if the question for the latch time failed.
  void OnFailure(unsigned number);
  /// Call if the meter refuses the question for the latch time.
  void OnRefused() { refused_ = true; }
  void ForgetRefusals() { refused_ = false; }
  bool refused() const { return refused_; }
  /// True if the meter has received the latest broadcast, and has not latched again since.
  bool Heard(unsigned number) const { return heard_ && asked_ == number && !doubted_; }
  /// True if it is certain that the meter has not received the latest broadcast.
  bool Missed(unsigned number) const { return missed_ && asked_ == number; }
  void Forget() { *this = {}; }

 private:
  std::optional<unsigned> asked_;  // number of broadcasts when the meter was last asked
  std::optional<Bytes> time_;      // the latch time that it returned
  bool heard_ = false;
  bool missed_ = false;
  bool doubted_ = false;
  bool refused_ = false;
};

// LatchedReads handles the latch for one meter: it decides when the broadcast is sent, and which
// latched values are valid after it.
//
//   FE 03 08 55 AA 33 CC   sent when due and the line is free
//   05 08 14 50            bytes have changed: the broadcast was received
//   05 08 1B 03 00         good; if the meter has not received the broadcast: waiting, no value
//
// After the reply to 08 14 50 no value of the previous latch is served: all latched points are set
// to waiting, and are read again at once. Otherwise a value of 12:00 would appear beside one of
// 12:15.
class LatchedReads {
 public:
  /// `period`: between broadcasts; zero: never. `line` must outlive this object.
  LatchedReads(Duration period, LineLatch& line) : period_(period), line_(line) {}

  /// True if the broadcast must be sent before any other request.
  bool IsDue(Instant now) const;
  /// Returns when the broadcast or the question for the latch time is due. Empty: never.
  std::optional<Instant> DueAt() const;
  /// True if the meter reports its latch time.
  bool tells() const { return period_ != Duration::zero() && !meter_.refused(); }
  /// True if the latch time must be asked before the next latched value is read.
  bool WantsTime() const { return tells() && meter_.WantsTime(line_.number()); }

  void OnClock(Now arrives) { line_.OnClock(arrives); }
  void OnSent() { line_.OnSent(); }
  /// Call if a request was sent and not answered. `asked`: its PDU.
  void OnFailure(View asked);
  void OnRefused() { meter_.OnRefused(); }
  void ForgetRefusals() { meter_.ForgetRefusals(); }
  void OnReconnect() { meter_.Forget(); }

  /// Updates the state from a reply, and sets the quality of the latched values in it.
  void Take(Reply& reply, const PointReads& reads);
  /// Describes the state, for the status. Empty: nothing to report.
  std::string Learned() const;

 private:
  /// Adds a waiting reading for each latched point that `answer` does not contain.
  static void Drop(Answer& answer, const PointReads& reads);

  const Duration period_;
  LineLatch& line_;
  MeterLatch meter_;
};

}  // namespace baudgate::protocols::set4tm
