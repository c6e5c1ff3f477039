// How an exchange ended. The order and spelling are a public contract: registers, JSON, logs, DDS.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <string_view>

namespace baudgate {

enum class Outcome : std::uint8_t {
  none = 0,         ///< no exchange has ended yet
  ok = 1,           ///< a good reply
  no_reply = 2,     ///< no reply came, or it was not asked
  partial = 3,      ///< the reply stopped mid-frame
  corrupt = 4,      ///< checksum or syntax is wrong
  unexpected = 5,   ///< a valid frame, but of another address or shape
  busy = 6,         ///< the device asks to be asked later
  refused = 7,      ///< the device understood and says no
  unsupported = 8,  ///< the device does not know what was asked
  line_down = 9,    ///< the port is closed or lost
};

inline constexpr std::size_t kOutcomeCount = 10;

constexpr std::string_view Name(Outcome outcome) {
  constexpr std::string_view kNames[kOutcomeCount] = {
      "none",       "ok",   "no_reply", "partial",     "corrupt",
      "unexpected", "busy", "refused",  "unsupported", "line_down"};
  return kNames[static_cast<std::size_t>(outcome)];
}

/// The device answered in its own protocol, whatever it said: it is alive.
constexpr bool ProvesLife(Outcome outcome) {
  return outcome == Outcome::ok || outcome == Outcome::busy || outcome == Outcome::refused ||
         outcome == Outcome::unsupported;
}

/// Bytes may still be under way after this outcome; the line has to drain before the next request.
constexpr bool NeedsDrain(Outcome outcome) {
  return outcome == Outcome::no_reply || outcome == Outcome::partial ||
         outcome == Outcome::corrupt || outcome == Outcome::unexpected;
}

}  // namespace baudgate
