// Which units of a server are not asked for a while, because the server closes the connection when
// they are: all share it. Told and asked by upstream.cpp; time is an argument.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <cstdint>

#include "gateway/base/time.h"

namespace baudgate::modbus {

class UnitPauses {
 public:
  /// 0.5 s, then twice as long each time.
  static constexpr Duration kFirst = std::chrono::milliseconds(500);
  static constexpr Duration kLongest = std::chrono::seconds(5);

  void OnAnswer(std::uint8_t unit) { units_[unit] = {.answers = true}; }
  /// A request of it has ended the connection twice. A unit that has answered others since the last
  /// such request does not pause for it: other clients are served by it.
  void OnClosed(std::uint8_t unit, Instant now) {
    State& state = units_[unit];
    if (state.answers) {
      state.answers = false;
      return;
    }
    state.until = now + state.next;
    state.next = std::min(2 * state.next, kLongest);
  }
  bool IsPaused(std::uint8_t unit, Instant now) const { return now < units_[unit].until; }

 private:
  struct State {
    bool answers = false;
    Duration next = kFirst;
    Instant until = Instant::min();
  };
  std::array<State, 256> units_{};
};

}  // namespace baudgate::modbus
