// The faults of a lagging server in random runs: names and parameters.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <string_view>

#include "tests/protocols/runs/lagging_server.h"

namespace baudgate::protocols {

enum class Trouble : std::uint8_t {
  lost,
  late,
  very_late,
  growing,
  held,  ///< holds a few replies back, later releases or drops them
  one_behind,
  two_behind,
  three_behind,
  copied,
  copied_later,
  copied_in_place,
  cut,
  damaged,
  mixed,
};
inline constexpr std::size_t kTroubles = 14;

inline std::string_view Name(Trouble trouble) {
  constexpr std::string_view kNames[kTroubles] = {
      "lost",    "late",         "very late",       "growing",
      "held",    "one behind",   "two behind",      "three behind",
      "copied",  "copied later", "copied in place", "cut",
      "damaged", "mixed"};
  return kNames[static_cast<std::size_t>(trouble)];
}

inline bool IsCopied(Trouble trouble) {
  return trouble >= Trouble::copied && trouble <= Trouble::copied_in_place;
}

/// True for faults that need a proof of the order of replies (docs/timeouts.md, "The limit").
inline bool IsBeyondProof(Trouble trouble) {
  return (trouble >= Trouble::very_late && trouble <= Trouble::three_behind) ||
         trouble == Trouble::mixed;
}

/// `ceiling` is the longest time until a reply begins. The reply ends later, by the time of its
/// characters.
inline ServerFaults FaultsOf(Trouble trouble, Duration ceiling) {
  switch (trouble) {
    case Trouble::lost:
      return {.drop = 8};
    case Trouble::late:
      return {.delay = 6, .longest_delay = ceiling};
    case Trouble::very_late:
      return {.delay = 8, .longest_delay = 3 * ceiling};
    case Trouble::growing:
      return {.delay = 3, .longest_delay = ceiling, .growing = true};
    case Trouble::held:
      return {.hold = 20};
    case Trouble::one_behind:
      return {.behind = 1};
    case Trouble::two_behind:
      return {.behind = 2};
    case Trouble::three_behind:
      return {.behind = 3};
    case Trouble::copied:
      return {.copy = 5};
    case Trouble::copied_later:
      return {.copy = 5, .copy_comes = ServerFaults::Copy::after_a_pause};
    case Trouble::copied_in_place:
      return {.copy = 5, .copy_comes = ServerFaults::Copy::in_place};
    case Trouble::cut:
      return {.cut = 6};
    case Trouble::damaged:
      return {.damage = 4};
    case Trouble::mixed:
      return {
          .drop = 40, .delay = 30, .longest_delay = ceiling, .hold = 80, .cut = 50, .damage = 50};
  }
  return {};
}

}  // namespace baudgate::protocols
