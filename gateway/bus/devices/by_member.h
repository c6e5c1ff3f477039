// What a part of the poller keeps for each member of the roster. An entry is made when it is first
// used, and never moves.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <deque>

#include "gateway/bus/devices/roster.h"

namespace baudgate {

template <typename State>
class ByMember {
 public:
  State& operator[](const Member& member) { return At(member.place); }
  const State& operator[](const Member& member) const { return At(member.place); }
  /// By place.
  State& At(std::size_t place) {
    Reach(place);
    return states_[place];
  }
  const State& At(std::size_t place) const {
    Reach(place);
    return states_[place];
  }

  auto begin() { return states_.begin(); }
  auto end() { return states_.end(); }
  auto begin() const { return states_.cbegin(); }
  auto end() const { return states_.cend(); }

 private:
  void Reach(std::size_t place) const {
    if (states_.size() <= place) states_.resize(place + 1);
  }

  mutable std::deque<State> states_;  // by place
};

}  // namespace baudgate
