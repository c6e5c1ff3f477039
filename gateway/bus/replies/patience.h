// How much longer than its reply time the line waits for a device whose replies came late again and
// again. Within the ceiling; docs/timeouts.md, "Late replies". With reply 300 ms:
//
//   a reply comes at 450 ms      300 ms: once may be chance
//   another one                  488 ms, a quarter more than it was late
//   replies in time              gradually less
//   it goes offline              300 ms: probes of an absent device cost the others no more
//
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "gateway/base/time.h"
#include "gateway/bus/devices/by_member.h"
#include "gateway/bus/devices/roster.h"

namespace baudgate {

class Patience {
 public:
  /// A reply came `lateness` after it was due.
  void OnLate(const Member& member, Duration lateness);
  /// A reply was taken, `lateness` after it was due; not above zero: in time.
  void OnAnswered(const Member& member, Duration lateness);
  void OnOffline(const Member& member) { states_[member] = {}; }

  /// Beyond the reply time of its configuration.
  Duration More(const Member& member) const;

 private:
  struct State {
    int late = 0;     // late replies since `in_time` was last high enough to forget them
    int in_time = 0;  // replies in time, in a row
    Duration most{};  // the lateness of the latest of these
    Duration more{};
  };

  static void Lengthen(State& state, Duration lateness);

  ByMember<State> states_;
};

}  // namespace baudgate
