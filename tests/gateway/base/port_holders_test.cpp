// Which programs have a port open, read from the real /proc of this machine.
// SPDX-License-Identifier: Apache-2.0
#include <fcntl.h>
#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <csignal>
#include <cstdlib>
#include <string>

#include "gateway/base/system_trouble.h"

namespace baudgate {
namespace {

/// A pty that this process holds open; after Begin a child process holds it too, until the test
/// ends.
class PortHolders : public ::testing::Test {
 protected:
  PortHolders() : master_(posix_openpt(O_RDWR | O_NOCTTY)) {
    EXPECT_EQ(grantpt(master_), 0);
    EXPECT_EQ(unlockpt(master_), 0);
    port_ = ptsname(master_);
    slave_ = open(port_.c_str(), O_RDWR | O_NOCTTY);
    EXPECT_GE(slave_, 0);
  }
  ~PortHolders() override {
    if (other_ > 0) {
      kill(other_, SIGKILL);
      waitpid(other_, nullptr, 0);
    }
    close(slave_);
    close(master_);
  }
  /// It inherits the open port.
  void Begin() {
    other_ = fork();
    if (other_ == 0) {
      while (true) pause();
    }
    ASSERT_GT(other_, 0);
  }

  std::string port_;
  pid_t other_ = -1;

 private:
  int master_;
  int slave_ = -1;
};

TEST_F(PortHolders, TheOtherProgramIsNamedWithItsNumber) {
  Begin();
  const std::string names = NameHolders(port_);
  EXPECT_TRUE(names.ends_with(", pid " + std::to_string(other_))) << names;
  EXPECT_EQ(names.find(std::to_string(getpid())), std::string::npos) << names;
}

TEST_F(PortHolders, WithoutAnotherACommandIsNamedThatFindsIt) {
  EXPECT_EQ(NameHolders(port_), "fuser -v " + port_);
}

TEST_F(PortHolders, SoIsAPortThatIsNotThere) {
  EXPECT_EQ(NameHolders("/dev/baudgate-none"), "fuser -v /dev/baudgate-none");
}

}  // namespace
}  // namespace baudgate
