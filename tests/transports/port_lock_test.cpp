// Exclusive opening, and the sentences that users read when it fails.
// SPDX-License-Identifier: Apache-2.0
#include <fcntl.h>
#include <gtest/gtest.h>
#include <signal.h>
#include <sys/file.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>

#include "gateway/tools/simulate/pty.h"
#include "transports/serial_port.h"

namespace baudgate {
namespace {

bool Contains(const std::string& text, const std::string& part) {
  return text.find(part) != std::string::npos;
}

TEST(OpenErrorText, SaysWhatToDo) {
  EXPECT_EQ(OpenErrorText("/dev/ttyUSB7", ENOENT),
            "no such port /dev/ttyUSB7; is the adapter plugged in?");
  EXPECT_TRUE(Contains(OpenErrorText("/dev/ttyUSB7", EACCES),
                       "add the user of the gateway to group "
                       "dialout"));
  EXPECT_TRUE(Contains(OpenErrorText("/dev/null", EACCES), "chgrp dialout /dev/null"))
      << "joining group root would be dangerous";
  EXPECT_TRUE(Contains(OpenErrorText("/dev/ttyS9", EIO), "hardware"));
  EXPECT_TRUE(Contains(OpenErrorText("/dev/ttyS9", EBUSY), "in use by another program"));
  EXPECT_TRUE(Contains(OpenErrorText("/dev/ttyS9", EMFILE), "/dev/ttyS9"));
}

TEST(OpenExclusive, MissingAndForeignFiles) {
  EXPECT_TRUE(Contains(OpenExclusive("/dev/no-such-port").error(), "no such port"));
  EXPECT_TRUE(Contains(OpenExclusive("/dev/null").error(), "is not a serial port"));
  EXPECT_EQ(OpenExclusive("/dev").error(), "/dev is a folder, not a serial port: correct port");
  EXPECT_TRUE(Contains(OpenExclusive("/proc/self/status").error(), "is an ordinary file"));
}

TEST(OpenExclusive, SecondOpenOfThisProcessIsNamed) {
  const auto pty = Pty::Create();
  const auto first = OpenExclusive(pty->slave_path());
  ASSERT_TRUE(first.ok()) << first.error();
  const auto second = OpenExclusive(pty->slave_path());
  ASSERT_FALSE(second.ok());
  EXPECT_TRUE(Contains(second.error(), "in use by another line of this gateway")) << second.error();

  // The locks can go long before the descriptor does.
  ReleaseLocks(*first);
  const auto third = OpenExclusive(pty->slave_path());
  EXPECT_TRUE(third.ok());
  close(*third);
  close(*first);
}

/// Another program that has the port locked until it is told to end.
class Holder {
 public:
  explicit Holder(const std::string& port) {
    int ready[2];
    if (pipe(ready) != 0) return;
    pid = fork();
    if (pid == 0) {
      const int fd = open(port.c_str(), O_RDWR | O_NOCTTY);
      const char locked = fd >= 0 && flock(fd, LOCK_EX) == 0 ? 1 : 0;
      (void)!write(ready[1], &locked, 1);
      for (;;) pause();
    }
    (void)!read(ready[0], &locked_, 1);
    close(ready[0]);
    close(ready[1]);
  }
  ~Holder() {
    kill(pid, SIGKILL);
    waitpid(pid, nullptr, 0);
  }
  bool locked() const { return locked_ == 1; }

  pid_t pid = -1;

 private:
  char locked_ = 0;
};

TEST(OpenExclusive, HolderIsNamedAndItsEndFreesThePort) {
  const auto pty = Pty::Create();
  {
    const Holder holder(pty->slave_path());
    ASSERT_TRUE(holder.locked());
    const auto fd = OpenExclusive(pty->slave_path());
    ASSERT_FALSE(fd.ok());
    EXPECT_TRUE(Contains(fd.error(), "(pid " + std::to_string(holder.pid) + ")")) << fd.error();
  }
  const auto fd = OpenExclusive(pty->slave_path());
  EXPECT_TRUE(fd.ok());
  close(*fd);
}

}  // namespace
}  // namespace baudgate
