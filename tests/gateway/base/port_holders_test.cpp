// Tests of PortHolders with the real /proc of this machine.
// SPDX-License-Identifier: Apache-2.0
#include <fcntl.h>
#include <gtest/gtest.h>
#include <sys/resource.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <csignal>
#include <cstdlib>
#include <string>

#include "gateway/base/system_trouble.h"
#include "gateway/base/whole_file.h"

namespace baudgate {
namespace {

/// Opens a pty in this process; after Begin, a child process has it open as well.
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

TEST_F(PortHolders, TheProgramThatHoldsThePortIsNamedWithItsPid) {
  Begin();
  const std::string names = NameHolders(port_);
  EXPECT_TRUE(names.ends_with(", pid " + std::to_string(other_))) << names;
  EXPECT_EQ(names.find(std::to_string(getpid())), std::string::npos) << names;
}

TEST_F(PortHolders, WithoutAHolderTheFuserCommandIsNamed) {
  EXPECT_EQ(NameHolders(port_), "find it with: fuser -v " + port_);
}

TEST_F(PortHolders, ForAMissingPortTheFuserCommandIsNamed) {
  EXPECT_EQ(NameHolders("/dev/baudgate-none"), "find it with: fuser -v /dev/baudgate-none");
}

TEST(UserName, IsFoundWhenNoFileCanBeOpened) {
  constexpr uid_t kNobody = 65534;
  constexpr uid_t kUnknown = 4'000'000'000;
  EXPECT_EQ(NameOfUser(0), "root");
  EXPECT_EQ(NameOfUser(kNobody), "nobody");
  EXPECT_EQ(NameOfUser(kUnknown), "4000000000");
  rlimit before{};
  ASSERT_EQ(getrlimit(RLIMIT_NOFILE, &before), 0);
  const rlimit none{0, before.rlim_max};
  ASSERT_EQ(setrlimit(RLIMIT_NOFILE, &none), 0);
  const std::string root = NameOfUser(0);
  const std::string nobody = NameOfUser(kNobody);
  ASSERT_EQ(setrlimit(RLIMIT_NOFILE, &before), 0);
  EXPECT_EQ(root, "root");
  EXPECT_EQ(nobody, "nobody");
}

namespace fs = std::filesystem;

class WholeFileTest : public ::testing::Test {
 protected:
  WholeFileTest() {
    fs::remove_all(folder_);
    fs::create_directories(folder_);
  }
  ~WholeFileTest() override { fs::remove_all(folder_); }

  const fs::path folder_ = fs::path(::testing::TempDir()) / "baudgate-whole-file";
  const fs::path file_ = folder_ / "file";
};

TEST_F(WholeFileTest, AWrittenFileIsReadBack) {
  EXPECT_FALSE(ReadWhole(file_));
  EXPECT_EQ(errno, ENOENT);
  EXPECT_EQ(WriteWhole(file_, "text"), 0);
  EXPECT_EQ(ReadWhole(file_), "text");
}

TEST_F(WholeFileTest, ATooLargeFileIsNotRead) {
  ASSERT_EQ(WriteWhole(file_, ""), 0);
  fs::resize_file(file_, std::uintmax_t{20} << 30U);
  EXPECT_FALSE(ReadWhole(file_));
  EXPECT_EQ(errno, EFBIG);
}

TEST_F(WholeFileTest, APipeInPlaceOfTheFileIsNotWaitedFor) {
  ASSERT_EQ(::mkfifo(file_.c_str(), 0600), 0);
  EXPECT_FALSE(ReadWhole(file_));
  EXPECT_EQ(errno, EINVAL);
}

TEST_F(WholeFileTest, APipeInTheWayOfAWriteIsRemoved) {
  ASSERT_EQ(::mkfifo((file_.string() + ".part").c_str(), 0600), 0);
  EXPECT_EQ(WriteWhole(file_, "text"), 0);
  EXPECT_EQ(ReadWhole(file_), "text");
  EXPECT_FALSE(fs::exists(file_.string() + ".part"));
}

}  // namespace
}  // namespace baudgate
