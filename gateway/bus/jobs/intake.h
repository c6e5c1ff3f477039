// Intake takes over the content of a reply: readings go to the point store, events to the listener,
// which saves them. What else follows is returned as ReplyEffects, which Job::TakeOver applies.
// EventDelivery follows the events of a device from the reply to the disk.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "config/model/point.h"
#include "gateway/base/time.h"
#include "gateway/bus/devices/poller_listener.h"
#include "gateway/bus/devices/roster.h"
#include "gateway/bus/jobs/unasked.h"
#include "gateway/bus/points/point_store.h"
#include "gateway/bus/replies/whose_reply.h"
#include "gateway/bus/schedule/schedule.h"
#include "gateway/bus/writes/write_queue.h"
#include "protocols/conversation.h"

namespace baudgate::bus {

class Job;

// Events that devices have reported when they were asked, from the reply to the disk: how old they
// can be, and how soon their device is asked again. Events of a device that sends unasked are in
// gateway/bus/jobs/unasked.h.
//
//   exchange                                 what follows
//   asked at 10 s: nothing is left           drained
//   asked at 20 s, answered at 20.1 s: A     to be kept; A is at most 10.1 s old
//   A is kept, the batch before was B        news: more may be left
//   A is kept, and so was the batch before   no news: it gives the last one again and again
class EventDelivery {
 public:
  struct Exchange {
    Instant asked{};          ///< when it was asked; events after this may be left in it
    Now answered{};           ///< the end of the reply
    bool background = false;  ///< a background read, not a request for events
  };
  /// A reply has brought `batch`. Empty: it has nothing that must be saved.
  std::optional<ReportedEvents> Take(const Device& device, protocols::EventBatch batch,
                                     const Exchange& exchange);
  /// The latest batch that is on the disk, maybe from before a restart, is `said` (EventBatch).
  Schedule::Brought OnKept(const Device& device, const std::string& said);
  /// Another device answers in its place; when that one was drained is not known.
  void OnReplaced(const Device& device) { entries_[device].drained_at.reset(); }

 private:
  struct Entry {
    std::optional<Instant> drained_at;  // what has happened before was not left in it
    std::optional<std::string> said;    // of what was kept last
    bool background = false;            // the batch that is not kept yet
  };

  ByMember<Entry> entries_;
};

/// What follows from a reply whose readings and events were taken over.
struct ReplyEffects {
  bool rechecked = false;           ///< a reading counts only when a second one agrees
  bool unconfirmed = false;         ///< a reading that jumped has not come again
  std::vector<QueryRef> read_soon;  ///< queries to read again for that
  std::vector<config::Group>
      repeat;  ///< seldom groups with a point that was not read, or is doubtful
  std::optional<LatestReadings::Points> stored;  ///< these points of a poll are in the store
  bool hold_events = false;                      ///< until the events of the reply are on the disk
  Duration peace{};  ///< the device wants to be left in peace for this long
};

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

}  // namespace baudgate::bus
