// The latch is a broadcast by which all meters of a line store their values of one moment, so that
// the values can be added up. No meter answers the broadcast, so each meter is asked later whether
// it has received it.
//
//   > FE 03 08 55 AA 33 CC C0 74     to all meters: store powers, voltages, energies and the time
//   > 05 08 14 50 8E 16              ask the time of the latest latch
//   < 05 00 00 12 02 01 09 02 EF DE  seven bytes; if they have changed, the broadcast was received
//
// Source: set-4tm reference, 9.1, 9.5 and 10. The meaning of the seven bytes is not used.
//
// LineLatch decides when the broadcast is sent; LatchedReads handles it for one meter.
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
/// True if the request reads values that a latch has stored: 08 14, 08 1B 01, 08 1B 03, 08 23 nn
/// 01.
bool ReadsLatched(View pdu);

/// Decides when the latch broadcast of a line is due: at whole multiples of a period since 1970.
class LineLatch {
 public:
  /// Call it with the time of this machine. Before the first call no broadcast is due.
  void OnClock(Now now);
  std::optional<Instant> DueAt(Duration period) const;
  /// Call it when a broadcast was sent. OnClock must have been called before, with the time at
  /// which the last byte of the broadcast arrives.
  void OnSent();

  unsigned number() const { return number_; }
  WallTime sent_at() const { return base_.wall; }

 private:
  std::optional<Now> clock_;
  Now base_{};  // time of the latest broadcast; before the first broadcast: of the first OnClock
  unsigned number_ = 0;
};

struct MeterBus final : Bus {
  LineLatch latch;
};

/// Decides whether the latched values of one meter were stored by the latest broadcast. The meter
/// is asked for its latch time once before a broadcast and once after it: a changed time proves
/// that the broadcast was received. `number`: the number of broadcasts so far (LineLatch::number).
class MeterLatch {
 public:
  bool WantsTime(unsigned number) const { return !refused_ && (asked_ != number || doubted_); }
  /// True if the meter was asked for its latch time after the latest broadcast.
  bool Told(unsigned number) const { return asked_ == number; }
  void OnTime(View time, unsigned number);
  /// Call it if the meter was silent: it may have been without power, so its latch time must be
  /// asked again.
  void Doubt() { doubted_ = true; }
  /// Call it if the question for the latch time got no reply: no latched value is then valid.
  void OnFailure(unsigned number);
  void OnRefused() { refused_ = true; }
  void ForgetRefusals() { refused_ = false; }
  bool refused() const { return refused_; }
  /// True if the meter has received the latest broadcast, and has not latched again since.
  bool Heard(unsigned number) const { return heard_ && asked_ == number && !doubted_; }
  /// True if it is certain that the meter has not received the latest broadcast.
  bool Missed(unsigned number) const { return missed_ && asked_ == number; }
  void Forget() { *this = {}; }

 private:
  // Number of broadcasts when the meter was last asked for its latch time.
  std::optional<unsigned> asked_;
  std::optional<Bytes> time_;
  bool heard_ = false;
  bool missed_ = false;
  bool doubted_ = false;
  bool refused_ = false;
};

// LatchedReads handles the latch for one meter: it decides when the broadcast is sent, and which
// latched values are valid after it.
//
//   FE 03 08 55 AA 33 CC   the broadcast, sent when it is due and the line is free
//   05 08 14 50            asks the latch time: if it has changed, the broadcast was received
//   05 08 1B 03 00         reads latched values: good if the broadcast was received, else "waiting"
//
// At the first reply to 08 14 50 after a broadcast, all latched points get the quality "waiting".
// If the broadcast was received, they are read again at once. Otherwise a value of 12:00 would
// appear beside a value of 12:15.
class LatchedReads {
 public:
  /// `period`: time between broadcasts; zero: no broadcasts are sent. `line` must outlive this
  /// object.
  LatchedReads(Duration period, LineLatch& line) : period_(period), line_(line) {}

  /// True if the latch broadcast must be sent before any other request.
  bool IsDue(Instant now) const;
  /// Returns when the broadcast or the question for the latch time is due. Empty: neither is due,
  /// because latching is off or refused, or no time is known yet.
  std::optional<Instant> DueAt() const;
  bool tells() const { return period_ != Duration::zero() && !meter_.refused(); }
  /// True if the meter must be asked for its latch time before the next latched value is read.
  bool WantsTime() const { return tells() && meter_.WantsTime(line_.number()); }

  void OnClock(Now arrives) { line_.OnClock(arrives); }
  void OnSent() { line_.OnSent(); }
  /// Call it if a request was sent and not answered. `asked`: the PDU of the request.
  void OnFailure(View asked);
  void OnRefused() { meter_.OnRefused(); }
  void ForgetRefusals() { meter_.ForgetRefusals(); }
  void OnReconnect() { meter_.Forget(); }

  /// Updates the state from a reply, and sets the quality of the latched values in the reply.
  void Take(Reply& reply, const PointReads& reads);
  /// Returns a text for the status. Empty: there is nothing to report.
  std::string Learned() const;

 private:
  /// Adds a reading with the quality "waiting" for each latched point that `answer` does not
  /// contain.
  static void Drop(Answer& answer, const PointReads& reads);

  const Duration period_;
  LineLatch& line_;
  MeterLatch meter_;
};

}  // namespace baudgate::protocols::set4tm
