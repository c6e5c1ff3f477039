// What a reply brings, what the end of each kind of job leads to, and how both are applied.
//
//   kind         its end leads to
//   poll         line time of the fast round; the count of its query; a seldom group that was not
//                read is read again
//   read-back    a seldom group as above; not answered: its points are in doubt; its query gone:
//                they are read by the queries of the new plan
//   events       nothing of its own
//   background   how long its exchange took, or that it was lost or not sent
//   probe        nothing of its own
//   write        its points are in doubt until they are read; it is confirmed, goes on, or is
//                answered. Not answered: polls go before the next write
//   routed       its clients are answered. An unanswered write: as above
//
// For all kinds the end says whether the member is there, unless the job does not judge it.
//
// EffectsOf decides that: facts in, effects out. WriteEndOf and VerdictOn decide how a write ended.
// Intake takes over the content of a reply: readings go to the point store, events to the listener,
// which saves them; what else follows is returned. EffectApplier applies all of it.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>

#include "config/model/point.h"
#include "gateway/base/outcome.h"
#include "gateway/base/time.h"
#include "gateway/base/value.h"
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
#include "gateway/bus/writes/write_command.h"
#include "gateway/bus/writes/write_queue.h"
#include "protocols/conversation.h"

namespace baudgate::bus {

// How a write ended, from the replies and from what its points show. Pure; used by the poller.

/// `sent`: a request that may have written went out. `may_have_acted`: as Answer says of a refusal.
WriteEnd WriteEndOf(Outcome outcome, bool sent, bool may_have_acted = false);

/// What a point shows after its write was confirmed.
enum class Comparison {
  nothing,
  written,  ///< numbers may differ by rounding
  between,  ///< the old value and the written one: a slewing output from 4 to 20 that shows 11
  another,
};
Comparison Compare(const config::Point& point, const PointWrite& write, const Value& shown);

struct ReadBackVerdict {
  WriteResult result;
  bool lost = false;  ///< an expected reading did not come
};
/// The verdict on a command that its device has confirmed, from what `record` shows since then. A
/// point that has not been read decides nothing.
ReadBackVerdict VerdictOn(const WriteQueue::Confirmed& one, const DeviceRecord& record);

/// Moves the requests of routes out of the job and changes nothing else of it.
EndEffects EffectsOf(Job& job, const JobEnd& end, Instant now);

class Intake {
 public:
  /// Both outlive it; `listener` may be made later than this.
  Intake(PointStore& store, PollerListener& listener) : store_(store), listener_(listener) {}

  /// The answer to a request of `job`, which belongs to `device`.
  ReplyEffects Take(const Job& job, Device& device, protocols::Answer answer, Instant now);
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
  void Store(const Job& job, Device& device, const protocols::Answer& answer, Instant now,
             ReplyEffects& effects);
  void Report(const Job& job, const Device& device, protocols::EventBatch batch,
              ReplyEffects& effects);

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
  void ApplyReply(const Job& job, Device& device, protocols::Answer answer, Instant now);
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

}  // namespace baudgate::bus
