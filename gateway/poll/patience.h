// How much longer than its reply time a device is waited for, because its replies were seen to come
// late again and again. Within the ceiling; docs/timeouts.md, "Late replies". With reply 300 ms:
//
//   a reply comes at 450 ms      300 ms: once may be chance
//   another one                  488 ms, a quarter more than it was late
//   replies in time              less by and by
//   it goes offline              300 ms: probes of who is away cost the others nothing more
//
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "gateway/base/time.h"
#include "gateway/poll/by_member.h"
#include "gateway/poll/roster.h"

namespace baudgate {

class Patience {
 public:
  /// A reply came so long after it was due.
  void OnLate(const Member& member, Duration lateness);
  /// A reply was taken, `lateness` after it was due; not above zero: in time.
  void OnAnswered(const Member& member, Duration lateness);
  void OnOffline(const Member& member) { states_[member] = {}; }

  /// Beyond the reply time of its configuration.
  Duration More(const Member& member) const;

 private:
  struct State {
    int late = 0;     // replies, of the latest
    int in_time = 0;  // replies in a row
    Duration most{};  // that one was late
    Duration more{};
  };

  static void Lengthen(State& state, Duration lateness);

  ByMember<State> states_;
};

}  // namespace baudgate
