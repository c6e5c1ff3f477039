// What follows from a reply or from the end of a job, as plain values. Made by
// gateway/bus/jobs/job_end.cpp (by Intake for replies, by EffectsOf for ends); applied by
// EffectApplier alone, in the order in which the fields stand. At the end of each job, behind
// `background`, it also plans the next background read and tells the probes. EventDelivery follows
// the events of a device from the reply to the disk.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "config/model/point.h"
#include "gateway/base/time.h"
#include "gateway/bus/devices/poller_listener.h"
#include "gateway/bus/devices/roster.h"
#include "gateway/bus/replies/whose_reply.h"
#include "gateway/bus/schedule/schedule.h"
#include "gateway/bus/writes/route_queue.h"
#include "gateway/bus/writes/write_command.h"
#include "gateway/bus/writes/write_queue.h"
#include "protocols/conversation.h"

namespace baudgate::bus {

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

/// What follows from the end of a job.
struct EndEffects {
  struct Background {
    bool sent = false;
    Duration took{};  ///< line time with its proof; zero: it was not answered
    bool proved = false;
  };
  struct FastPoll {
    Duration wire{};
    bool answered = false;
    bool last_of_round = false;
  };
  struct Poll {
    std::size_t query = 0;
    bool answered = false;
  };
  /// What follows for the points of a command that were under way.
  struct Write {
    enum class Next : std::uint8_t {
      answer,   ///< its client, with `result`
      confirm,  ///< the device has confirmed it; its client is answered after the read-back
      go_on,    ///< with the points that remain
    };
    std::vector<std::size_t> unknown;   ///< points whose values are unknown until they are read
    std::vector<PointWrite> confirmed;  ///< a reading that agrees with one of these counts
    Next next = Next::answer;
    WriteResult result{};
  };

  /// The group is to be polled again, because a part of it was not read.
  struct Repeat {
    config::Group group{};
    bool soon = false;  ///< Schedule::RepeatSoon; the rule is in gateway/bus/jobs/job_end.cpp
  };

  std::optional<Background> background;
  std::optional<FastPoll> fast_poll;
  std::optional<Poll> poll;
  std::optional<Repeat> repeat;
  std::vector<std::size_t> read_again;  ///< points of a read-back whose query was gone
  std::vector<std::size_t> doubt;       ///< these points are uncertain
  bool polls_first = false;             ///< go before the next write to the device
  bool judges_member = true;            ///< the end says whether the member answers
  bool wrote = false;                   ///< its request may have changed the device
  std::vector<std::pair<RoutedRequest, RoutedReply>> replies;
  std::optional<Write> write;
};

}  // namespace baudgate::bus
