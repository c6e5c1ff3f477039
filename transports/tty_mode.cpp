// SPDX-License-Identifier: Apache-2.0
#include "transports/tty_mode.h"

#include <asm/ioctls.h>
#include <asm/termbits.h>
#include <sys/ioctl.h>

#include "transports/serial_settings.h"

namespace baudgate {

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
  if (turned_on(local_, now.local_, ICANON)) add("input comes by whole lines");
  if (turned_on(local_, now.local_, ISIG)) add("some bytes became signals");
  if (turned_on(input_, now.input_, ICRNL | INLCR | IGNCR | ISTRIP)) add("input is translated");
  if (turned_on(output_, now.output_, OPOST)) add("output is translated");
  if (turned_on(input_, now.input_, IXON | IXOFF)) add("XON/XOFF is on");
  if (turned_on(control_, now.control_, CRTSCTS)) add("RTS/CTS is on");
  if (turned_on(now.input_, input_, PARMRK | INPCK)) add("damaged characters are not marked");
  if (turned_on(now.control_, control_, CREAD)) add("reception is off");
  if (changes.empty()) add("other settings");
  return changes;
}

}  // namespace baudgate
