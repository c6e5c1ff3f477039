// The result of a write, for its client and for the audit. docs/writes.md has the
// table for users.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <string_view>

namespace baudgate {

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
