// Events that devices have told when they were asked, from the reply to the disk: how old they can
// be, and how soon their device is asked again. What one says unasked is gateway/poll/speaker.h's
// affair.
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
#include "gateway/poll/by_member.h"
#include "gateway/poll/poller_listener.h"
#include "gateway/poll/roster.h"
#include "gateway/poll/schedule.h"
#include "protocols/conversation.h"

namespace baudgate {

class EventDelivery {
 public:
  struct Exchange {
    Instant asked{};          ///< before it the device may have looked what it has
    Now answered{};           ///< the end of the reply
    bool background = false;  ///< asked for what can wait, and not for events
  };
  /// A reply has brought `batch`. Nothing: there is nothing in it that has to be kept.
  std::optional<ReportedEvents> Take(const Device& device, EventBatch batch,
                                     const Exchange& exchange);
  /// The latest batch that is on the disk, maybe from before a restart, is `said` (EventBatch).
  Schedule::Brought OnKept(const Device& device, const std::string& said);
  /// Another device answers in its place: when that was drained is not known.
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
