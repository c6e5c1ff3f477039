// SPDX-License-Identifier: Apache-2.0
#include "transports/pty_settings.h"

#include <asm/ioctls.h>
#include <asm/termbits.h>
#include <sys/ioctl.h>

#include <cerrno>
#include <cstring>

namespace baudgate {
namespace {

using config::Parity;

/// The parity that `device` has where nothing speaks against it.
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
  // Zero is no rate: its user has hung up.
  if (ioctl(fd, TCGETS2, &mode) != 0 || mode.c_ospeed == 0) return user;
  user.baud = static_cast<int>(mode.c_ospeed);
  user.parity = ParityOf(mode, device.parity);
  user.stop_bits = (mode.c_cflag & CSTOPB) != 0 ? 2 : 1;
  // Seven data bits have a parity beside them, or nobody would use them.
  if (user.parity == Parity::none && device.parity != Parity::none) user.data_bits = 8;
  return user;
}

}  // namespace baudgate
