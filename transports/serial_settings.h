// Puts a tty into raw mode with the settings of the configuration and checks that the driver really
// took them. Works on file descriptors; all calls return at once. SetPtyFormat and ReadPtyFormat
// handle the settings of a pty, and TtyMode sees whether another program has changed them.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>

#include "config/model/serial.h"
#include "gateway/base/result.h"
#include "transports/transport.h"

namespace baudgate::transports {

/// A pty has no bit rate, parity or hang-up delay, and forgets such settings without saying so.
bool IsPty(int fd);

/// Characters with wrong parity or framing.
enum class Damage : std::uint8_t {
  marked,    ///< by PARMRK, which parity.h reads
  as_it_is,  ///< like all others, which costs the kernel less
};

/// Everything in one go: raw mode, marks, speed and format, RS-485, low latency. `serial` is what
/// the wire shall see (OnTheWire of parity.h). `port` is for messages.
Status ApplySerialSettings(int fd, const config::SerialSettings& serial, const std::string& port,
                           Damage damage = Damage::marked);

/// Raw mode without anything else, for the far end of a pty.
Status MakeRaw(int fd);

/// Speed, format and flow control that the driver says it uses now.
Result<config::SerialSettings> ReadSerialSettings(int fd);

/// Whether a driver that was asked for one thing and reports another did well enough: the speed may
/// differ by the rounding of its divider, nothing else may. The error says what to do.
Status CompareSettings(const config::SerialSettings& asked, const config::SerialSettings& actual,
                       const std::string& port);

/// The same for RS-485: a driver that cannot do something leaves it out without an error. The
/// error names each key that differs, and what it is with this driver.
Status CompareRs485(const config::Rs485& asked, const config::Rs485& actual,
                    const std::string& port);

bool SameSettings(const config::SerialSettings& a, const config::SerialSettings& b);

/// Totals since the driver was loaded; nothing where it does not count.
std::optional<PortCounters> ReadDriverCounters(int fd);

/// Empty: a pty, or a driver that does not tell.
std::optional<ModemLines> ReadModemLines(int fd);
/// A pty takes everything, and it has no effect there.
Status SetSwitch(int fd, PortSwitch which, bool on, const std::string& port);
/// As after the opening of a port: DTR and RTS on, but RTS where the driver uses it, no break. Best
/// effort.
void ResetSwitches(int fd, const config::SerialSettings& serial);

/// Undoes tcflow(TCOOFF) of another program, which outlives that program. Flow control of the line
/// stays as it is.
void LetOutputGo(int fd);

/// Throws away what the port has received and nobody has read.
void FlushInput(int fd);
/// Throws away what it has not sent yet. How far that reaches depends on the driver: to all but the
/// UART's own few bytes with the kernel's serial drivers, nowhere with most USB adapters (usbserial
/// has no such call; cdc-acm has). Of a pty, seen with Linux 6.18: up to 4095 bytes that the kernel
/// has put before the other side stay readable there, the rest is gone; and nobody who waits for
/// room is woken.
void FlushOutput(int fd);
/// Both.
void FlushAll(int fd);
/// How much of the output the driver still holds; always 0 of a pty, whatever waits in it.
std::size_t UnsentOutput(int fd);

// What the program at the far end of a pty has set it to. A pty keeps bit rate, stop bits, PARODD,
// CMSPAR and the input flags; it forgets data bits and PARENB.
//
//   PARODD                  odd parity
//   CMSPAR                  space parity; with PARODD mark parity
//   INPCK without PARODD    even parity: its user checks it
//   PARMRK without INPCK    no parity: its user marks damaged characters and checks no parity
//   none of these           it cannot be told whether there is even parity or none

/// From now on a reader that sets nothing fits a device with these settings. `fd`: either side.
Status SetPtyFormat(int fd, const config::SerialSettings& serial);

/// What the reader of the pty has set, as far as that can be told; `device` says the rest. Of an
/// `fd` that is no pty: `device`.
config::SerialSettings ReadPtyFormat(int fd, const config::SerialSettings& device);

// The settings that a tty has at one moment, to see whether another program has changed them since:
// stty, ModemManager, brltty, a getty. Any program that may open the port can.
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

}  // namespace baudgate::transports
