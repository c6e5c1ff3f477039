// How long one fast round of all polled devices of a line takes: the point store derives the age
// limits of fast values from it. Driven by gateway/bus/jobs/upkeep.cpp and
// gateway/bus/jobs/effect_applier.cpp.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "gateway/base/time.h"
#include "gateway/bus/devices/by_member.h"
#include "gateway/bus/devices/roster.h"
#include "gateway/bus/points/point_store.h"
#include "gateway/bus/schedule/effects.h"

namespace baudgate {

class FastRounds {
 public:
  /// All references outlive it.
  FastRounds(const Roster& roster, PointStore& store) : roster_(roster), store_(store) {}

  /// A poll of the fast group has ended. Failures, retries and waiting say nothing about how long a
  /// round takes: an outage must not make old values look younger.
  void OnPoll(const Member& member, const EndEffects::FastPoll& poll, Instant now);
  /// Its queries have changed.
  void OnPlan(const Device& device);
  /// One of the devices has come or gone.
  void Measure(Instant now) const;

 private:
  struct State {
    bool clean = true;  // nothing has failed in the round under way
    Duration wire{};    // its line time so far
    Duration last{};    // line time of the last whole round
  };

  const Roster& roster_;
  PointStore& store_;
  ByMember<State> states_;
};

}  // namespace baudgate
