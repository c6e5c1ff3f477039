// `Intake` distributes the content of a reply: readings go to the point store, events to the
// listener, which saves them. It returns further consequences as `ReplyEffects`, which
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

// `EventDelivery` tracks events that a device reported on request, until they are saved on disk. It
// computes how old the events can be, and whether the device may have more. (Devices that send
// events unasked are in gateway/bus/jobs/unasked.h.) Example:
//
//   exchange                                 what follows
//   asked at 10 s: no event is left          the device was drained (empty) at 10 s
//   asked at 20 s, answered at 20.1 s: A     batch A is to be saved; it is at most 10.1 s old
//   A is saved; the batch before was B       Brought::news: the device may have further events
//   A is saved; the batch before was A       Brought::no_news: the device repeats its last batch
class EventDelivery {
 public:
  struct Exchange {
    Instant asked{};          ///< when the device was asked; it may contain later events
    Now answered{};           ///< when the reply ended
    bool background = false;  ///< the exchange was a background read, not a request for events
  };
  /// Takes the events of a reply. Returns the events to be saved, with the greatest age that they
  /// can have; empty: the reply contained no events.
  std::optional<ReportedEvents> Take(const Device& device, protocols::EventBatch batch,
                                     const Exchange& exchange);
  /// The latest batch of the device is saved on disk (it may be from before a restart). `said`:
  /// EventBatch::said of this batch. The result tells whether the device may have further events.
  Schedule::Brought OnKept(const Device& device, const std::string& said);
  /// Another device answers in place of `device`, so it is unknown when it last had no events left.
  void OnReplaced(const Device& device) { entries_[device].drained_at.reset(); }

 private:
  struct Entry {
    std::optional<Instant> drained_at;  // when the device had no events left; empty: unknown
    std::optional<std::string> said;    // EventBatch::said of the latest saved batch
    bool background = false;  // the batch that is not saved yet came from a background read
  };

  ByMember<Entry> entries_;
};

struct ReplyEffects {
  bool rechecked = false;    ///< a reading was suspicious, so a second reading must confirm it
  bool unconfirmed = false;  ///< a reading that jumped was not confirmed by the second reading
  std::vector<QueryRef> read_soon;  ///< queries to read again soon to confirm a reading
  /// Groups to poll again, because a point of a seldom group (once, daily) was not read or is
  /// doubtful.
  std::vector<config::Group> repeat;
  /// The points whose values a poll has written to the point store.
  std::optional<LatestReadings::Points> stored;
  bool hold_events = false;  ///< the device must not be asked for more events until these are saved
  Duration peace{};          ///< the device asked to get no request for this time
};

class Intake {
 public:
  /// Both references must stay valid for the lifetime of this object. `listener` is not used by the
  /// constructor, so it can be constructed later.
  Intake(PointStore& store, PollerListener& listener) : store_(store), listener_(listener) {}

  ReplyEffects Take(const Job& job, Device& device, protocols::Answer answer, Instant now);
  void TakeUnasked(const Device& device, Speaker::Said said);
  Schedule::Brought OnKept(const Device& device, const std::string& said) {
    return delivery_.OnKept(device, said);
  }
  /// All events that the device had before `asked` are saved on disk.
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
