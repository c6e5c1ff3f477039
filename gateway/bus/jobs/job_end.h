// How each kind of job ends: facts in, effects out. Applied by EffectApplier.
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
// WriteEndOf and VerdictOn decide how a write ended, and EffectApplier applies the effects of
// replies and ends.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>

#include "config/model/point.h"
#include "gateway/base/outcome.h"
#include "gateway/base/time.h"
#include "gateway/base/value.h"
#include "gateway/bus/jobs/device_tracker.h"
#include "gateway/bus/jobs/intake.h"
#include "gateway/bus/jobs/job.h"
#include "gateway/bus/points/point_store.h"
#include "gateway/bus/schedule/effects.h"
#include "gateway/bus/schedule/write_queue.h"
#include "gateway/bus/writes/write_command.h"

namespace baudgate {

// How a write ended, from the replies and from what its points show. Pure; used by the poller.

/// `sent`: a request that may have written went out. `may_have_acted`: as Answer says of a refusal.
WriteEnd WriteEndOf(Outcome outcome, bool sent, bool may_have_acted = false);

/// As users see it.
Value WrittenValue(const config::Point& point, const PointWrite& write);

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

// Applies what follows from a reply (intake.h) or from the end of a job
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
