// SPDX-License-Identifier: Apache-2.0
#include "transports/serial_settings.h"

#include <asm/ioctls.h>
#include <asm/termbits.h>
#include <sys/ioctl.h>

#include <cerrno>
#include <cstring>

// The header asm/termbits has the kernel's termios. The C library's termios has no free bit rates
// and refuses 7E1 on a pty that was opened before. The two headers cannot be included together.
#include <asm/ioctls.h>
#include <asm/termbits.h>
#include <linux/serial.h>
#include <linux/tty_flags.h>
#include <sys/ioctl.h>
#include <sys/stat.h>
#include <sys/sysmacros.h>

#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <tuple>

namespace baudgate::transports {
namespace {

constexpr int kHighestBaud = 921600;
constexpr int kLowestBaud = 300;
// The major device numbers of UNIX98 pty slaves (Documentation/admin-guide/devices.txt).
constexpr unsigned kFirstPtyMajor = 136;
constexpr unsigned kLastPtyMajor = 143;
constexpr int kBaudTolerancePerMille = 30;
constexpr int kFewestDataBits = 5;
constexpr std::uint8_t kXon = 0x11;
constexpr std::uint8_t kXoff = 0x13;

std::string LastError() { return std::strerror(errno); }

Error NotTaken(const std::string& port, const std::string& what) {
  return Error{"the driver of " + port + " refuses " + what + ": " + LastError()};
}

void SetRaw(termios2& mode) {
  // INPCK is set without parity too, because framing errors are marked only with INPCK.
  mode.c_iflag = INPCK | PARMRK;
  mode.c_oflag = 0;
  mode.c_lflag = 0;
  // CLOCAL ignores the carrier. Without it, an unconnected DCD would block the port and hang it up.
  mode.c_cflag = (mode.c_cflag & HUPCL) | CREAD | CLOCAL;
  mode.c_cc[VMIN] = 1;
  mode.c_cc[VTIME] = 0;
}

void SetFormat(termios2& mode, const config::SerialSettings& serial) {
  mode.c_cflag |= BOTHER | (BOTHER << IBSHIFT);
  mode.c_ispeed = static_cast<speed_t>(serial.baud);
  mode.c_ospeed = static_cast<speed_t>(serial.baud);
  constexpr std::array<tcflag_t, 4> kSizes = {CS5, CS6, CS7, CS8};
  mode.c_cflag |= kSizes[static_cast<std::size_t>(serial.data_bits - kFewestDataBits)];
  constexpr std::array<tcflag_t, 5> kParities = {0, PARENB, PARENB | PARODD,
                                                 PARENB | PARODD | CMSPAR, PARENB | CMSPAR};
  mode.c_cflag |= kParities[static_cast<std::size_t>(serial.parity)];
  if (serial.stop_bits == 2) mode.c_cflag |= CSTOPB;
  if (serial.rtscts) mode.c_cflag |= CRTSCTS;
  if (!serial.xonxoff) return;
  mode.c_iflag |= IXON | IXOFF;
  mode.c_cc[VSTART] = kXon;
  mode.c_cc[VSTOP] = kXoff;
}

Status CheckRange(const config::SerialSettings& serial) {
  if (serial.baud < kLowestBaud || serial.baud > kHighestBaud) {
    return Error{"bit rate " + std::to_string(serial.baud) +
                 " is outside 300…921600 bit/s; correct serial"};
  }
  if (serial.data_bits < kFewestDataBits || serial.data_bits > 8 ||
      (serial.stop_bits != 1 && serial.stop_bits != 2)) {
    return Error{"serial format " + serial.ToString() +
                 " is not possible; write 5 to 8 data bits and 1 or 2 stop bits in serial"};
  }
  return {};
}

/// Rounds up to whole milliseconds, the driver's unit, because a shorter delay would cut off bits.
std::uint32_t Milliseconds(Duration delay) {
  return static_cast<std::uint32_t>(std::chrono::ceil<std::chrono::milliseconds>(delay).count());
}

config::Rs485 FromDriver(const serial_rs485& mode) {
  config::Rs485 rs485;
  rs485.enabled = (mode.flags & SER_RS485_ENABLED) != 0;
  rs485.rts_active_high = (mode.flags & SER_RS485_RTS_ON_SEND) != 0;
  rs485.receive_while_sending = (mode.flags & SER_RS485_RX_DURING_TX) != 0;
  rs485.delay_before_send = std::chrono::milliseconds(mode.delay_rts_before_send);
  rs485.delay_after_send = std::chrono::milliseconds(mode.delay_rts_after_send);
  return rs485;
}

Status ApplyRs485(int fd, const config::Rs485& wanted, const std::string& port) {
  serial_rs485 mode{};
  if (!wanted.enabled) {
    // A port without RS-485 support is not an error if RS-485 is off.
    const bool on = ioctl(fd, TIOCGRS485, &mode) == 0 && (mode.flags & SER_RS485_ENABLED) != 0;
    if (!on) return {};
    mode.flags &= ~static_cast<__u32>(SER_RS485_ENABLED);
    if (ioctl(fd, TIOCSRS485, &mode) != 0) return NotTaken(port, "to leave RS-485 mode");
    return {};
  }
  mode.flags = SER_RS485_ENABLED;
  mode.flags |= wanted.rts_active_high ? SER_RS485_RTS_ON_SEND : SER_RS485_RTS_AFTER_SEND;
  if (wanted.receive_while_sending) mode.flags |= SER_RS485_RX_DURING_TX;
  mode.delay_rts_before_send = Milliseconds(wanted.delay_before_send);
  mode.delay_rts_after_send = Milliseconds(wanted.delay_after_send);
  const serial_rs485 asked = mode;
  if (ioctl(fd, TIOCSRS485, &mode) != 0) {
    return Error{"the driver of " + port + " has no RS-485 mode (" + LastError() +
                 "); remove `rs485:` if the adapter switches direction by itself"};
  }
  serial_rs485 actual{};
  if (ioctl(fd, TIOCGRS485, &actual) != 0) return NotTaken(port, "to read back RS-485 mode");
  if (const Status same = CompareRs485(wanted, FromDriver(actual), port); !same) return same;
  if (actual.flags == asked.flags) return {};
  return Error{"the driver of " + port +
               " does not control RTS as `rts_active_high` requires; use an adapter that switches "
               "direction by itself"};
}

/// Ignores errors: a driver without this flag needs none, or has the setting elsewhere.
void ApplyLowLatency(int fd, bool wanted) {
  serial_struct driver{};
  if (ioctl(fd, TIOCGSERIAL, &driver) != 0) return;
  const bool has = (driver.flags & static_cast<int>(ASYNC_LOW_LATENCY)) != 0;
  if (has == wanted) return;
  driver.flags ^= static_cast<int>(ASYNC_LOW_LATENCY);
  (void)ioctl(fd, TIOCSSERIAL, &driver);
}

config::SerialSettings FromTermios(const termios2& mode) {
  config::SerialSettings serial;
  serial.baud = static_cast<int>(mode.c_ospeed);
  const auto size = mode.c_cflag & CSIZE;
  serial.data_bits = size == CS8 ? 8 : size == CS7 ? 7 : size == CS6 ? 6 : 5;
  if ((mode.c_cflag & PARENB) != 0) {
    const bool odd = (mode.c_cflag & PARODD) != 0;
    const bool fixed = (mode.c_cflag & CMSPAR) != 0;
    serial.parity = fixed ? (odd ? config::Parity::mark : config::Parity::space)
                          : (odd ? config::Parity::odd : config::Parity::even);
  }
  serial.stop_bits = (mode.c_cflag & CSTOPB) != 0 ? 2 : 1;
  serial.rtscts = (mode.c_cflag & CRTSCTS) != 0;
  serial.xonxoff = (mode.c_iflag & IXON) != 0;
  return serial;
}

}  // namespace

bool IsPty(int fd) {
  struct stat info {};
  if (fstat(fd, &info) != 0 || !S_ISCHR(info.st_mode)) return false;
  const unsigned device = major(info.st_rdev);
  return device >= kFirstPtyMajor && device <= kLastPtyMajor;
}

Status MakeRaw(int fd) {
  termios2 mode{};
  if (ioctl(fd, TCGETS2, &mode) != 0) return Error{LastError()};
  SetRaw(mode);
  mode.c_iflag = 0;
  mode.c_cflag |= CS8;
  if (ioctl(fd, TCSETS2, &mode) != 0) return Error{LastError()};
  return {};
}

Result<config::SerialSettings> ReadSerialSettings(int fd) {
  termios2 mode{};
  if (ioctl(fd, TCGETS2, &mode) != 0) return Error{LastError()};
  return FromTermios(mode);
}

Status CompareSettings(const config::SerialSettings& asked, const config::SerialSettings& actual,
                       const std::string& port) {
  const std::string did =
      "the driver of " + port + " did not set " + asked.ToString() + " but " + actual.ToString();
  const long difference = std::labs(static_cast<long>(asked.baud) - actual.baud);
  if (difference * 1000 > static_cast<long>(asked.baud) * kBaudTolerancePerMille) {
    return Error{did + "; set serial to a bit rate that this port supports"};
  }
  if (asked.data_bits != actual.data_bits || asked.parity != actual.parity) {
    const bool helps = asked.data_bits == 7 && (asked.parity == config::Parity::even ||
                                                asked.parity == config::Parity::odd);
    return Error{did + (helps ? "; set `parity: software`"
                              : "; set serial to a format that this port supports")};
  }
  if (asked.stop_bits != actual.stop_bits) {
    return Error{did + "; set serial to a number of stop bits that this port supports"};
  }
  if (asked.rtscts != actual.rtscts) {
    return Error{"the driver of " + port + " has no RTS/CTS flow control; remove `rtscts`"};
  }
  return {};
}

Status CompareRs485(const config::Rs485& asked, const config::Rs485& actual,
                    const std::string& port) {
  std::string differences;
  const auto compare = [&](const char* key, const std::string& wants, const std::string& does) {
    if (wants == does) return;
    differences += std::string(differences.empty() ? "" : ", ") + key + " is " + does;
  };
  const auto flag = [](bool on) { return std::string(on ? "true" : "false"); };
  const auto delay = [](Duration time) { return std::to_string(Milliseconds(time)) + "ms"; };
  compare("enabled", flag(asked.enabled), flag(actual.enabled));
  compare("rts_active_high", flag(asked.rts_active_high), flag(actual.rts_active_high));
  compare("receive_while_sending", flag(asked.receive_while_sending),
          flag(actual.receive_while_sending));
  compare("delay_before_send", delay(asked.delay_before_send), delay(actual.delay_before_send));
  compare("delay_after_send", delay(asked.delay_after_send), delay(actual.delay_after_send));
  if (differences.empty()) return {};
  return Error{"the driver of " + port + " does not support these `rs485:` settings: with them " +
               differences +
               "; write values that the driver supports, or use an adapter that switches direction "
               "by itself"};
}

Status ApplySerialSettings(int fd, const config::SerialSettings& serial, const std::string& port,
                           Damage damage) {
  if (const Status range = CheckRange(serial); !range) return range;
  const bool pty = IsPty(fd);
  termios2 mode{};
  if (ioctl(fd, TCGETS2, &mode) != 0) {
    return Error{port + " is not a serial port: " + LastError()};
  }
  SetRaw(mode);
  SetFormat(mode, serial);
  // A pty damages no characters. Its INPCK tells the simulated device at the far end that this
  // program uses a parity.
  if (pty && serial.parity == config::Parity::none) mode.c_iflag &= ~static_cast<tcflag_t>(INPCK);
  if (damage == Damage::as_it_is) mode.c_iflag &= ~static_cast<tcflag_t>(INPCK | PARMRK);
  const tcflag_t wanted = mode.c_iflag;
  if (ioctl(fd, TCSETS2, &mode) != 0) return NotTaken(port, serial.ToString());

  termios2 actual{};
  if (ioctl(fd, TCGETS2, &actual) != 0) return NotTaken(port, "to read its settings back");
  // These flags belong to the tty layer, not to the driver, so they can be checked on a pty too.
  if (((actual.c_iflag ^ wanted) & (INPCK | PARMRK)) != 0) {
    return Error{port + " cannot report damaged characters; use another adapter or driver"};
  }
  if (!pty) {
    if (const Status same = CompareSettings(serial, FromTermios(actual), port); !same) return same;
  }
  if (const Status rs485 = ApplyRs485(fd, serial.rs485, port); !rs485) return rs485;
  ApplyLowLatency(fd, serial.low_latency);
  LetOutputGo(fd);
  return {};
}

bool SameSettings(const config::SerialSettings& a, const config::SerialSettings& b) {
  const auto rs485 = [](const config::Rs485& mode) {
    return std::tuple(mode.enabled, mode.delay_before_send, mode.delay_after_send,
                      mode.rts_active_high, mode.receive_while_sending);
  };
  const auto all = [&rs485](const config::SerialSettings& serial) {
    return std::tuple(serial.baud, serial.data_bits, serial.parity, serial.stop_bits,
                      serial.software_parity, serial.rtscts, serial.xonxoff, serial.low_latency,
                      rs485(serial.rs485));
  };
  return all(a) == all(b);
}

std::optional<PortCounters> ReadDriverCounters(int fd) {
  serial_icounter_struct counted{};
  if (ioctl(fd, TIOCGICOUNT, &counted) != 0) return std::nullopt;
  // A break is counted as a framing error too.
  return PortCounters{.parity = static_cast<std::uint32_t>(counted.parity),
                      .framing = static_cast<std::uint32_t>(counted.frame) +
                                 static_cast<std::uint32_t>(counted.brk),
                      .overrun = static_cast<std::uint32_t>(counted.overrun) +
                                 static_cast<std::uint32_t>(counted.buf_overrun),
                      .breaks = static_cast<std::uint32_t>(counted.brk)};
}

std::optional<ModemLines> ReadModemLines(int fd) {
  int bits = 0;
  if (ioctl(fd, TIOCMGET, &bits) != 0) return std::nullopt;
  const auto is_on = [bits](int bit) { return (bits & bit) != 0; };
  return ModemLines{.dtr = is_on(TIOCM_DTR),
                    .rts = is_on(TIOCM_RTS),
                    .cts = is_on(TIOCM_CTS),
                    .dsr = is_on(TIOCM_DSR),
                    .dcd = is_on(TIOCM_CAR),
                    .ring = is_on(TIOCM_RNG)};
}

Status SetSwitch(int fd, PortSwitch which, bool on, const std::string& port) {
  if (IsPty(fd)) return {};
  int bit = which == PortSwitch::dtr ? TIOCM_DTR : TIOCM_RTS;
  const bool done = which == PortSwitch::break_signal
                        ? ioctl(fd, on ? TIOCSBRK : TIOCCBRK, nullptr) == 0
                        : ioctl(fd, on ? TIOCMBIS : TIOCMBIC, &bit) == 0;
  if (done) return {};
  constexpr std::array<const char*, 3> kNames = {"DTR", "RTS", "a break"};
  return NotTaken(port, kNames[static_cast<std::size_t>(which)]);
}

void ResetSwitches(int fd, const config::SerialSettings& serial) {
  if (IsPty(fd)) return;
  (void)ioctl(fd, TIOCCBRK, nullptr);
  int bits = TIOCM_DTR | (serial.rs485.enabled || serial.rtscts ? 0 : TIOCM_RTS);
  (void)ioctl(fd, TIOCMBIS, &bits);
}

void LetOutputGo(int fd) { (void)ioctl(fd, TCXONC, TCOON); }

void FlushInput(int fd) { (void)ioctl(fd, TCFLSH, TCIFLUSH); }

void FlushOutput(int fd) { (void)ioctl(fd, TCFLSH, TCOFLUSH); }

void FlushAll(int fd) { (void)ioctl(fd, TCFLSH, TCIOFLUSH); }

std::size_t UnsentOutput(int fd) {
  int count = 0;
  return ioctl(fd, TIOCOUTQ, &count) == 0 && count > 0 ? static_cast<std::size_t>(count) : 0;
}

namespace {

using config::Parity;

/// Returns the parity that a pty's flags show, see transports/serial_settings.h. Flags that fit
/// even and no parity mean `device`, or none if `device` is odd.
Parity ParityOf(const termios2& mode, Parity device) {
  const bool odd = (mode.c_cflag & PARODD) != 0;
  if ((mode.c_cflag & CMSPAR) != 0) return odd ? Parity::mark : Parity::space;
  if (odd) return Parity::odd;
  if ((mode.c_iflag & INPCK) != 0) return Parity::even;
  const bool marks = (mode.c_iflag & PARMRK) != 0;
  return device == Parity::odd || marks ? Parity::none : device;
}

}  // namespace

Status SetPtyFormat(int fd, const config::SerialSettings& serial) {
  termios2 mode{};
  if (ioctl(fd, TCGETS2, &mode) != 0) return Error{std::strerror(errno)};
  mode.c_iflag &= ~static_cast<tcflag_t>(INPCK | PARMRK);
  mode.c_cflag &= ~static_cast<tcflag_t>(CBAUD | (CBAUD << IBSHIFT) | PARODD | CMSPAR | CSTOPB);
  mode.c_cflag |= BOTHER | (BOTHER << IBSHIFT);
  mode.c_ispeed = static_cast<speed_t>(serial.baud);
  mode.c_ospeed = static_cast<speed_t>(serial.baud);
  if (serial.parity != Parity::none) mode.c_iflag |= INPCK;
  const bool fixed = serial.parity == Parity::mark || serial.parity == Parity::space;
  if (fixed) mode.c_cflag |= CMSPAR;
  if (serial.parity == Parity::odd || serial.parity == Parity::mark) mode.c_cflag |= PARODD;
  if (serial.stop_bits == 2) mode.c_cflag |= CSTOPB;
  if (ioctl(fd, TCSETS2, &mode) != 0) return Error{std::strerror(errno)};
  return {};
}

config::SerialSettings ReadPtyFormat(int fd, const config::SerialSettings& device) {
  config::SerialSettings user = device;
  termios2 mode{};
  // A rate of zero means that the program at the far end has hung up.
  if (ioctl(fd, TCGETS2, &mode) != 0 || mode.c_ospeed == 0) return user;
  user.baud = static_cast<int>(mode.c_ospeed);
  user.parity = ParityOf(mode, device.parity);
  user.stop_bits = (mode.c_cflag & CSTOPB) != 0 ? 2 : 1;
  // Seven data bits without parity are not used, so no parity means eight data bits.
  if (user.parity == Parity::none && device.parity != Parity::none) user.data_bits = 8;
  return user;
}

std::optional<TtyMode> TtyMode::Read(int fd) {
  termios2 found{};
  if (ioctl(fd, TCGETS2, &found) != 0) return std::nullopt;
  TtyMode mode;
  mode.input_ = found.c_iflag;
  mode.output_ = found.c_oflag;
  mode.control_ = found.c_cflag;
  mode.local_ = found.c_lflag;
  mode.read_at_least_ = {found.c_cc[VMIN], found.c_cc[VTIME]};
  if (const auto serial = ReadSerialSettings(fd)) mode.format_ = serial->ToString();
  return mode;
}

std::string TtyMode::ChangesTo(const TtyMode& now) const {
  std::string changes;
  const auto add = [&changes](const std::string& text) {
    changes += (changes.empty() ? "" : ", ") + text;
  };
  if (format_ != now.format_) add(format_ + " became " + now.format_);
  const auto turned_on = [](std::uint32_t before, std::uint32_t after, std::uint32_t flags) {
    return (~before & after & flags) != 0;
  };
  if (turned_on(local_, now.local_, ECHO)) add("echo is on");
  if (turned_on(local_, now.local_, ICANON)) add("input is passed on only in whole lines");
  if (turned_on(local_, now.local_, ISIG)) add("isig is on: bytes such as 03 (Ctrl-C) are removed");
  if (turned_on(input_, now.input_, ICRNL | INLCR | IGNCR | ISTRIP)) add("input is translated");
  if (turned_on(output_, now.output_, OPOST)) add("output is translated");
  if (turned_on(input_, now.input_, IXON | IXOFF)) add("XON/XOFF is on");
  if (turned_on(control_, now.control_, CRTSCTS)) add("RTS/CTS is on");
  if (turned_on(now.input_, input_, PARMRK | INPCK)) add("damaged characters are not marked");
  if (turned_on(now.control_, control_, CREAD)) add("reception is off");
  if (changes.empty()) add("other settings");
  return changes;
}

}  // namespace baudgate::transports
