// Takes over the content of replies: readings go to the point store, events to the listener, which
// saves them. What else follows is returned to gateway/bus/jobs/job_end.h. Speaker is the device
// that sends unasked, and which of its events may wait for the disk.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <optional>
#include <string>
#include <vector>

#include "gateway/base/time.h"
#include "gateway/bus/devices/arrivals.h"
#include "gateway/bus/devices/poller_listener.h"
#include "gateway/bus/devices/roster.h"
#include "gateway/bus/exchange/line.h"
#include "gateway/bus/jobs/job.h"
#include "gateway/bus/points/point_store.h"
#include "gateway/bus/schedule/effects.h"
#include "protocols/conversation.h"

namespace baudgate {

// The device of a line that sends unasked: what its messages mean, and which of its events may wait
// for the disk (gateway/bus/devices/arrivals.h). Events beyond that are lost, which is
// reported with the next one that is saved:
//
//   1000 messages, the disk fails    1000 batches to be saved
//   3 more, of an event each         nothing to be saved; 3 lost, one warning
//   one is saved, then a message     to be saved: "3 events before this one lost: the disk failed"
class Speaker {
 public:
  /// For the device that sends unasked. Both references outlive it.
  Speaker(const Roster& roster, LineObserver& observer);

  /// Null: no device sends unasked.
  Device* device() const { return device_; }
  /// What `device` sends unasked. Null: there is no such device.
  const Standing* standing() const;
  /// Its messages count.
  bool in_use() const { return device_ != nullptr && device_->in_use; }

  struct Said {
    Outcome outcome = Outcome::ok;
    std::string reason;
    std::string remedy;
    Now received{};  ///< its last byte
    std::vector<Sample> samples;
    std::optional<ReportedEvents> events;  ///< to be kept
    std::size_t lost = 0;                  ///< events that are not
    std::string warning;                   ///< of the first of these; else empty
  };
  /// Bytes of the line. Returns a new finding on the message before, if that was unreadable and now
  /// looks different.
  std::optional<Finding> Hear(View bytes, Instant now);
  /// Its message could not be read: returns what it looks like.
  Finding OnDamaged() { return observer_.OnUnaskedDamage(); }
  /// Only in use.
  Said OnMessage(const UnaskedMessage& message, Now now);
  /// What its message looked like.
  Finding Look(const Said& said);
  /// When OnTimer may have something even without a message.
  std::optional<Instant> DueAt() const;
  /// What follows without a message; its outcome does not count.
  std::optional<Said> OnTimer(Now now);

  /// A batch of its events is on the disk.
  void OnKept() { backlog_.OnKept(); }
  /// All that it was heard to send is saved. It sends at once, so no event is left in it.
  bool drained() const { return device_ != nullptr && backlog_.waiting() == 0; }

 private:
  Said Take(Answer answer, Now received);
  void Keep(EventBatch batch, Said& said);

  Device* const device_;
  LineObserver& observer_;
  Instant last_{};             // its last message
  Duration rest_ = kLongIdle;  // before that one
  EventBacklog backlog_;
  bool told_lost_ = false;  // the user knows that events are lost
};

class Intake {
 public:
  /// Both outlive it; `listener` may be made later than this.
  Intake(PointStore& store, PollerListener& listener) : store_(store), listener_(listener) {}

  /// The answer to a request of `job`, which belongs to `device`.
  ReplyEffects Take(const Job& job, Device& device, Answer answer, Instant now);
  /// A message that a device has sent unasked.
  void TakeUnasked(const Device& device, Speaker::Said said);
  /// See EventDelivery.
  Schedule::Brought OnKept(const Device& device, const std::string& said) {
    return delivery_.OnKept(device, said);
  }
  /// It was asked at `asked` or later, and has no events that are not kept.
  void OnDrained(const Device& device, Instant asked) { listener_.OnDrained(device.index, asked); }
  void OnReplaced(const Device& device) { delivery_.OnReplaced(device); }

 private:
  void Store(const Job& job, Device& device, const Answer& answer, Instant now,
             ReplyEffects& effects);
  void Report(const Job& job, const Device& device, EventBatch batch, ReplyEffects& effects);

  PointStore& store_;
  PollerListener& listener_;
  EventDelivery delivery_;
};

}  // namespace baudgate
