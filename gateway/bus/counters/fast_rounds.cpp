// SPDX-License-Identifier: Apache-2.0
#include "gateway/bus/counters/fast_rounds.h"

#include <utility>

namespace baudgate {

void FastRounds::OnPoll(const Member& member, const EndEffects::FastPoll& poll, Instant now) {
  State& state = states_[member];
  state.wire += poll.wire;
  state.clean = state.clean && poll.answered;
  if (!poll.last_of_round) return;
  const Duration took = std::exchange(state.wire, {});
  if (!std::exchange(state.clean, true)) return;
  state.last = took;
  Measure(now);
}

void FastRounds::OnPlan(const Device& device) {
  State& state = states_[device];
  state.wire = {};
  state.clean = true;
}

void FastRounds::Measure(Instant now) const {
  Duration cycle{};
  for (const auto& device : roster_.devices()) {
    if (device->in_use && !device->health.absent()) cycle += states_[*device].last;
  }
  for (const auto& device : roster_.devices()) store_.SetLineCycle(device->index, cycle, now);
}

}  // namespace baudgate
