// Prints the tty driver's state of one port without baudgate's code, to check baudgate's numbers.
// SPDX-License-Identifier: Apache-2.0
#include <asm/ioctls.h>
#include <fcntl.h>
#include <linux/serial.h>
#include <linux/tty_flags.h>
#include <sys/ioctl.h>
#include <unistd.h>

#include <cerrno>
#include <cstdio>
#include <cstring>

namespace {

void PrintCounters(int fd) {
  serial_icounter_struct counted{};
  if (ioctl(fd, TIOCGICOUNT, &counted) != 0) {
    std::printf("counters=unsupported (%s)\n", std::strerror(errno));
    return;
  }
  std::printf("rx=%d tx=%d frame=%d parity=%d overrun=%d buf_overrun=%d brk=%d\n", counted.rx,
              counted.tx, counted.frame, counted.parity, counted.overrun, counted.buf_overrun,
              counted.brk);
}

void PrintLowLatency(int fd) {
  serial_struct driver{};
  if (ioctl(fd, TIOCGSERIAL, &driver) != 0) {
    std::printf("low_latency=unsupported (%s)\n", std::strerror(errno));
    return;
  }
  std::printf("low_latency=%d\n", (driver.flags & static_cast<int>(ASYNC_LOW_LATENCY)) != 0);
}

void PrintRs485(int fd) {
  serial_rs485 mode{};
  if (ioctl(fd, TIOCGRS485, &mode) != 0) {
    std::printf("rs485=unsupported (%s)\n", std::strerror(errno));
    return;
  }
  std::printf("rs485=%d\n", (mode.flags & SER_RS485_ENABLED) != 0);
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 2) {
    std::fprintf(stderr, "usage: port_facts PORT\n");
    return 2;
  }
  const int fd = open(argv[1], O_RDWR | O_NOCTTY | O_NONBLOCK);
  if (fd < 0) {
    std::fprintf(stderr, "cannot open %s: %s\n", argv[1], std::strerror(errno));
    return 4;
  }
  PrintCounters(fd);
  PrintLowLatency(fd);
  PrintRs485(fd);
  close(fd);
}
