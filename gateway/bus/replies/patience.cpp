// SPDX-License-Identifier: Apache-2.0
#include "gateway/bus/replies/patience.h"

#include <algorithm>

namespace baudgate {
namespace {

constexpr int kAgain = 2;
/// After this many replies in time, a late one counts as the first again.
constexpr int kRepliesToForget = 100;
/// Each reply in time takes off this part.
constexpr int kPartTakenOff = 1024;
constexpr Duration kLeastPatience = 1ms;

/// How much longer than the reply time and the gap the line may wait before it reaches the ceiling.
Duration RoomOf(const Member& member) {
  const LineTimes& times = member.times;
  return std::max<Duration>(times.ceiling - times.reply - times.gap, {});
}

}  // namespace

void Patience::Lengthen(State& state, Duration lateness) {
  state.more = std::max(state.more, lateness + lateness / 4);
}

void Patience::OnLate(const Member& member, Duration lateness) {
  if (lateness <= Duration::zero() || lateness > RoomOf(member)) return;
  State& state = states_[member];
  state.in_time = 0;
  state.most = std::max(state.most, lateness);
  if (++state.late >= kAgain) Lengthen(state, state.most);
}

void Patience::OnAnswered(const Member& member, Duration lateness) {
  State& state = states_[member];
  if (lateness > Duration::zero()) {
    state.in_time = 0;
    return Lengthen(state, lateness);
  }
  state.more -= state.more / kPartTakenOff;
  if (state.more < kLeastPatience) state.more = {};
  if (++state.in_time < kRepliesToForget) return;
  state.late = 0;
  state.most = {};
}

Duration Patience::More(const Member& member) const {
  return std::min(states_[member].more, RoomOf(member));
}

}  // namespace baudgate
