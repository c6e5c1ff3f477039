// `Intake` takes over the content of a reply: readings go to the point store, events to the
// listener, which saves them. Further consequences are returned as `ReplyEffects`, which
// Job::TakeOver applies. `EventDelivery` tracks the events of a device from the reply to the disk.
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

// `EventDelivery` tracks events that a device reported when it was asked, from the reply to the
// disk: how old they can be, and how soon the device is asked again. Events of a device that sends
// unasked are in gateway/bus/jobs/unasked.h.
//
//   exchange                                 what follows
//   asked at 10 s: no event is left          drained
//   asked at 20 s, answered at 20.1 s: A     A is to be saved; it is at most 10.1 s old
//   A is saved; the batch before was B       news: the device may have further events
//   A is saved; the batch before was A       no news: the device repeats its last batch
class EventDelivery {
 public:
  struct Exchange {
    Instant asked{};          ///< when the device was asked; later events may be left in it
    Now answered{};           ///< the end of the reply
    bool background = false;  ///< the exchange was a background read, not a request for events
  };
  /// Takes the batch of a reply. Returns the events to save; empty: there are none.
  std::optional<ReportedEvents> Take(const Device& device, protocols::EventBatch batch,
                                     const Exchange& exchange);
  /// The latest batch of the device is on the disk, perhaps since before a restart. `said`: see
  /// EventBatch.
  Schedule::Brought OnKept(const Device& device, const std::string& said);
  /// Another device answers in place of `device`: it is unknown when that one was drained.
  void OnReplaced(const Device& device) { entries_[device].drained_at.reset(); }

 private:
  struct Entry {
    std::optional<Instant> drained_at;  // earlier events were not left in the device
    std::optional<std::string> said;    // EventBatch::said of the latest saved batch
    bool background = false;  // the batch that is not saved yet came from a background read
  };

  ByMember<Entry> entries_;
};

struct ReplyEffects {
  bool rechecked = false;    ///< a reading counts only if a second reading agrees
  bool unconfirmed = false;  ///< a reading that jumped was not confirmed by the second reading
  std::vector<QueryRef> read_soon;  ///< queries to read again for such a second reading
  /// Seldom groups with a point that was not read, or is doubtful.
  std::vector<config::Group> repeat;
  /// The points of a poll that are in the point store now.
  std::optional<LatestReadings::Points> stored;
  bool hold_events = false;  ///< ask for no further events until these are on the disk
  Duration peace{};          ///< the device wants no request for this time
};

class Intake {
 public:
  /// Both references must stay valid for the lifetime of this object; `listener` may be constructed
  /// later.
  Intake(PointStore& store, PollerListener& listener) : store_(store), listener_(listener) {}

  ReplyEffects Take(const Job& job, Device& device, protocols::Answer answer, Instant now);
  void TakeUnasked(const Device& device, Speaker::Said said);
  Schedule::Brought OnKept(const Device& device, const std::string& said) {
    return delivery_.OnKept(device, said);
  }
  /// The device was asked at `asked` or later, and has no events that are not saved.
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
