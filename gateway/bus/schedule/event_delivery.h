// Events that devices have reported when they were asked, from the reply to the disk: how old they
// can be, and how soon their device is asked again. Events of a device that sends unasked are in
// gateway/bus/jobs/speaker.h.
//
//   exchange                                 what follows
//   asked at 10 s: nothing is left           drained
//   asked at 20 s, answered at 20.1 s: A     to be kept; A is at most 10.1 s old
//   A is kept, the batch before was B        news: more may be left
//   A is kept, and so was the batch before   no news: it gives the last one again and again
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>

#include "gateway/base/time.h"
#include "gateway/bus/devices/by_member.h"
#include "gateway/bus/devices/poller_listener.h"
#include "gateway/bus/devices/roster.h"
#include "gateway/bus/schedule/schedule.h"
#include "protocols/conversation.h"

namespace baudgate {

class EventDelivery {
 public:
  struct Exchange {
    Instant asked{};          ///< when it was asked; events after this may be left in it
    Now answered{};           ///< the end of the reply
    bool background = false;  ///< a background read, not a request for events
  };
  /// A reply has brought `batch`. Empty: it has nothing that must be saved.
  std::optional<ReportedEvents> Take(const Device& device, EventBatch batch,
                                     const Exchange& exchange);
  /// The latest batch that is on the disk, maybe from before a restart, is `said` (EventBatch).
  Schedule::Brought OnKept(const Device& device, const std::string& said);
  /// Another device answers in its place; when that one was drained is not known.
  void OnReplaced(const Device& device) { states_[device].drained_at.reset(); }

 private:
  struct State {
    std::optional<Instant> drained_at;  // what has happened before was not left in it
    std::optional<std::string> said;    // of what was kept last
    bool background = false;            // the batch that is not kept yet
  };

  ByMember<State> states_;
};

}  // namespace baudgate
