// The settings that a tty has at one moment, to see whether another program has changed them since:
// stty, ModemManager, brltty, a getty. Any program that may open the port can.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>

namespace baudgate {

class TtyMode {
 public:
  /// Empty: it is no tty, or it is gone.
  static std::optional<TtyMode> Read(int fd);

  bool operator==(const TtyMode&) const = default;
  /// "9600 7E1 became 38400 8N1, echo is on": what differs in `now`.
  std::string ChangesTo(const TtyMode& now) const;

 private:
  std::uint32_t input_ = 0;  // flags of the kernel's termios
  std::uint32_t output_ = 0;
  std::uint32_t control_ = 0;
  std::uint32_t local_ = 0;
  std::array<std::uint8_t, 2> read_at_least_{};  // VMIN, VTIME
  std::string format_;                           // "9600 7E1"
};

}  // namespace baudgate
