// Outcome says how an exchange ended, WriteEnd and WriteResult how a write ended. The order and
// spelling of the words are a public contract: registers, JSON, logs, DDS.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
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

// The result of a write, for its client and for the audit. docs/writes.md has the
// table for users.
enum class WriteEnd : std::uint8_t {
  ok,        ///< the device has confirmed it
  differs,   ///< the device has confirmed it, and then showed another value
  refused,   ///< by the device
  busy,      ///< the device wants it later; or too many writes wait for the line
  unknown,   ///< it was sent, and its result is not known
  not_sent,  ///< the line or the device was not there, or its time was over
  denied,    ///< by the gateway: permission, limits, selection, interlock, audit
};

inline constexpr std::size_t kWriteEnds = 7;

struct WriteResult {
  WriteEnd end = WriteEnd::ok;
  std::string reason{};    ///< one sentence; of ok only what remains in doubt
  bool read_back = false;  ///< ok: the device shows what was written
  /// How many of several points were confirmed, in their order, before the first that was not.
  std::size_t written = 0;
  /// How many of several points belonged to exchanges that were begun. If not above `written`, the
  /// end is that of the first point that was not begun, and of all after it. Of four points:
  ///
  ///   written 2, tried 3, refused    ok, ok, refused, not_sent
  ///   written 2, tried 2, not_sent   ok, ok, not_sent, not_sent: the deadline came in between
  std::size_t tried = 0;
  /// Refused, and nothing was sent: the protocol has no form for the value (0.05 in steps of 0.1).
  bool unfit = false;
};

/// The result of the point at this place of a command of several.
WriteResult ResultOf(const WriteResult& whole, std::size_t place);

std::string_view Name(WriteEnd end);  ///< "not_sent"

}  // namespace baudgate
