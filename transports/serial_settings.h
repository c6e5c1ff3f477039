// Functions that put a tty into raw mode with the configured settings, and check that the driver
// has accepted them. They work on file descriptors and return at once. SetPtyFormat and
// ReadPtyFormat handle the settings of a pty, and TtyMode detects changes by another program.
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

/// True for a pty. A pty has no bit rate, parity or hang-up delay, and drops such settings without
/// an error.
bool IsPty(int fd);

/// How the tty delivers characters with wrong parity or framing.
enum class Damage : std::uint8_t {
  marked,    ///< marked by PARMRK; ParmrkDecoder decodes the marks
  as_it_is,  ///< unmarked, which costs the kernel less
};

/// Applies all settings: raw mode, marks, speed and format, RS-485, low latency. `serial` is the
/// format on the wire, as OnTheWire returns it. `port` is the name for messages.
Status ApplySerialSettings(int fd, const config::SerialSettings& serial, const std::string& port,
                           Damage damage = Damage::marked);

/// Sets raw mode only, for the far end of a pty.
Status MakeRaw(int fd);

Result<config::SerialSettings> ReadSerialSettings(int fd);

/// Checks that the settings that the driver reports are those that were asked for. The speed may
/// differ by 3 %, because the driver rounds its divider. The error names the remedy.
Status CompareSettings(const config::SerialSettings& asked, const config::SerialSettings& actual,
                       const std::string& port);

/// Checks that the driver has accepted the RS-485 settings, because a driver drops unsupported
/// settings without an error. The error names each key that differs and its value in the driver.
Status CompareRs485(const config::Rs485& asked, const config::Rs485& actual,
                    const std::string& port);

bool SameSettings(const config::SerialSettings& a, const config::SerialSettings& b);

/// Returns totals since the driver was loaded; nothing if the driver does not count.
std::optional<PortCounters> ReadDriverCounters(int fd);

/// Returns the modem lines; nothing for a pty, or if the driver does not report them.
std::optional<ModemLines> ReadModemLines(int fd);
/// Switches DTR, RTS or break. A pty accepts every call without effect.
Status SetSwitch(int fd, PortSwitch which, bool on, const std::string& port);
/// Sets the signals as they are after the opening of a port: DTR on, no break, and RTS on unless
/// the driver controls it. Errors are ignored.
void ResetSwitches(int fd, const config::SerialSettings& serial);

/// Resumes output that another program has stopped with tcflow(TCOOFF), because the stop outlasts
/// that program. Output that the device has stopped by flow control stays stopped.
void LetOutputGo(int fd);

void FlushInput(int fd);
/// Discards bytes that have not been sent. The effect depends on the driver: the kernel's serial
/// drivers discard all but the few bytes in the UART; most USB adapters discard nothing (usbserial
/// has no such call; cdc-acm has). With a pty, seen with Linux 6.18, up to 4095 bytes stay readable
/// at the other side, the rest is discarded, and a writer that waits for room is not woken.
void FlushOutput(int fd);
void FlushAll(int fd);
/// Returns the number of output bytes in the driver; always 0 for a pty.
std::size_t UnsentOutput(int fd);

// Format of a pty, as the program at its far end has set it. A pty stores bit rate, stop bits,
// PARODD, CMSPAR and the input flags; it drops data bits and PARENB.
//
//   PARODD                  odd parity
//   CMSPAR                  space parity; with PARODD mark parity
//   INPCK without PARODD    even parity: the program checks it
//   PARMRK without INPCK    no parity: the program marks damaged characters and checks no parity
//   none of these           even parity or none

/// Sets the pty to the settings of a simulated device, so that a program that opens the pty and
/// sets nothing matches them. `fd` may be either side.
Status SetPtyFormat(int fd, const config::SerialSettings& serial);

/// Returns the format that the program has set, as far as it can be read; the rest comes from
/// `device`. If `fd` is not a pty, returns `device`.
config::SerialSettings ReadPtyFormat(int fd, const config::SerialSettings& device);

// TtyMode is a copy of a tty's settings at one moment, to detect later changes by another program:
// stty, ModemManager, brltty, a getty. Any program that may open the port can change them.
class TtyMode {
 public:
  /// Returns nothing if `fd` is not a tty, or if the tty is gone.
  static std::optional<TtyMode> Read(int fd);

  bool operator==(const TtyMode&) const = default;
  /// Returns how `now` differs. Example: "9600 7E1 became 38400 8N1, echo is on".
  std::string ChangesTo(const TtyMode& now) const;

 private:
  // Flags of the kernel's termios.
  std::uint32_t input_ = 0;
  std::uint32_t output_ = 0;
  std::uint32_t control_ = 0;
  std::uint32_t local_ = 0;
  std::array<std::uint8_t, 2> read_at_least_{};  // VMIN, VTIME
  std::string format_;                           // "9600 7E1"
};

}  // namespace baudgate::transports
