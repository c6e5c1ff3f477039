// `Outcome` is how an exchange ended; `WriteEnd` and `WriteResult` are how a write ended. The order
// and spelling of the names are a public contract: registers, JSON, logs and DDS show them.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>

namespace baudgate {

enum class Outcome : std::uint8_t {
  none = 0,  ///< no exchange has ended yet
  ok = 1,
  no_reply = 2,    ///< no reply came, or the device was not asked
  partial = 3,     ///< the reply stopped mid-frame
  corrupt = 4,     ///< checksum or syntax is wrong
  unexpected = 5,  ///< a valid frame, but with another address or form than expected
  busy = 6,        ///< the device asks to be asked later
  refused = 7,     ///< the device understood the request and refuses it
  unsupported = 8,
  line_down = 9,  ///< the port is closed or lost
};

inline constexpr std::size_t kOutcomeCount = 10;

constexpr std::string_view Name(Outcome outcome) {
  constexpr std::string_view kNames[kOutcomeCount] = {
      "none",       "ok",   "no_reply", "partial",     "corrupt",
      "unexpected", "busy", "refused",  "unsupported", "line_down"};
  return kNames[static_cast<std::size_t>(outcome)];
}

/// True if the device answered in its protocol, even with a refusal: the device is alive.
constexpr bool ProvesLife(Outcome outcome) {
  return outcome == Outcome::ok || outcome == Outcome::busy || outcome == Outcome::refused ||
         outcome == Outcome::unsupported;
}

/// True if bytes may still arrive after this outcome, so that the line must stay silent (drain)
/// before the next request.
constexpr bool NeedsDrain(Outcome outcome) {
  return outcome == Outcome::no_reply || outcome == Outcome::partial ||
         outcome == Outcome::corrupt || outcome == Outcome::unexpected;
}

// The result of a write, for its client and for the audit. docs/writes.md has the table for users.
enum class WriteEnd : std::uint8_t {
  ok,       ///< the device has confirmed the write
  differs,  ///< the device has confirmed the write, and then showed another value
  refused,
  busy,      ///< the device asks to be asked later, or too many writes wait for the line
  unknown,   ///< the write was sent, but its result is not known
  not_sent,  ///< the line or the device was absent, or the deadline of the write had passed
  denied,    ///< refused by the gateway: permission, limits, selection, interlock, audit
};

inline constexpr std::size_t kWriteEnds = 7;

struct WriteResult {
  WriteEnd end = WriteEnd::ok;
  std::string reason{};    ///< one sentence; if `end` is ok: empty, or a remaining doubt
  bool read_back = false;  ///< with `ok`: the device shows the written value
  /// For a write of several points: the points are written in order, and this many were confirmed
  /// before the first point that was not.
  std::size_t written = 0;
  /// For a write of several points: how many points belonged to exchanges that were started.
  /// Example with four points:
  ///
  ///   written 2, tried 3, refused    ok, ok, refused, not_sent
  ///   written 2, tried 2, not_sent   ok, ok, not_sent, not_sent: the deadline passed in between
  ///
  /// If `tried` is not above `written`, `end` is the result of all points that were not written.
  std::size_t tried = 0;
  /// With `refused`: nothing was sent, because the protocol has no form for the value (0.05 in
  /// steps of 0.1).
  bool unfit = false;
  /// With `denied`: the point has another value than the client expects (WriteAsk::Part::expect).
  bool changed = false;
};

/// Returns the result of the point number `place`, from 0, in a write of several points.
WriteResult ResultOf(const WriteResult& whole, std::size_t place);

std::string_view Name(WriteEnd end);

}  // namespace baudgate
