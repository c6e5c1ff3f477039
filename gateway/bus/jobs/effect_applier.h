// What a reply brings, and what its job leads to. Intake takes over the content of a reply:
// readings go to the point store, events to the listener, which saves them; what else follows is
// returned. EffectApplier applies that, and the effects of the ends of jobs (job_end.h).
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>

#include "gateway/base/time.h"
#include "gateway/bus/counters/accounts.h"
#include "gateway/bus/devices/poller_listener.h"
#include "gateway/bus/devices/roster.h"
#include "gateway/bus/jobs/chooser.h"
#include "gateway/bus/jobs/device_tracker.h"
#include "gateway/bus/jobs/job.h"
#include "gateway/bus/jobs/unasked.h"
#include "gateway/bus/points/point_store.h"
#include "gateway/bus/replies/whose_reply.h"
#include "gateway/bus/schedule/effects.h"
#include "protocols/conversation.h"

namespace baudgate {

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

// Applies what follows from a reply (Intake) or from the end of a job
// (gateway/bus/schedule/effects.h), field by field: to the schedule, the queues, the accounts and
// the store. Decides nothing.
class EffectApplier {
 public:
  /// All references outlive it.
  EffectApplier(OwedReplies& owed, Agenda& agenda, Accounts& accounts, DeviceTracker& tracker,
                Intake& intake)
      : owed_(owed), agenda_(agenda), accounts_(accounts), tracker_(tracker), intake_(intake) {}

  /// The answer to a request of `job` counts.
  void ApplyReply(const Job& job, Device& device, Answer answer, Instant now);
  /// Its events are on the disk. `said`: see Conversation.
  void OnEventsKept(const Device& device, const std::string& said, Instant now);
  /// Another device answers in its place.
  void OnReplaced(Device& device, Now now) {
    tracker_.OnReplaced(device, now);
    intake_.OnReplaced(device);
  }
  /// A request to the member is repeated.
  void OnRetry(const Member& member) { accounts_.devices.OnRetry(member); }
  /// Answers the clients of the job. Returns a write of which points remain to be written.
  std::optional<Job::Write> ApplyEnd(Job& done, EndEffects effects, const JobEnd& end, Instant now);

 private:
  std::optional<Job::Write> OnWriteEnd(Job::Write& write, Device& device,
                                       const EndEffects::Write& effects, Instant now);

  OwedReplies& owed_;
  Agenda& agenda_;
  Accounts& accounts_;
  DeviceTracker& tracker_;
  Intake& intake_;
};

}  // namespace baudgate
