// The far end's pty: links, unplugging, and what stays when a reader leaves.
// SPDX-License-Identifier: Apache-2.0
#include "gateway/tools/simulate/pty.h"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cerrno>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <utility>

namespace baudgate {
namespace {

namespace fs = std::filesystem;

class PtyLink : public ::testing::Test {
 protected:
  PtyLink() {
    std::string pattern = (fs::temp_directory_path() / "baudgate-pty-XXXXXX").string();
    folder_ = mkdtemp(pattern.data());
    link_ = folder_ / "line";
  }
  ~PtyLink() override { fs::remove_all(folder_); }

  fs::path folder_;
  fs::path link_;
};

TEST_F(PtyLink, LeadsToTheSlaveAndGoesAtTheEnd) {
  {
    const auto pty = Pty::Create(link_.string());
    ASSERT_TRUE(pty.ok()) << pty.error();
    EXPECT_EQ(fs::read_symlink(link_), pty->slave_path());
    EXPECT_EQ(pty->path(), link_.string());
  }
  EXPECT_FALSE(fs::is_symlink(link_));
  EXPECT_TRUE(fs::is_empty(folder_));
}

TEST_F(PtyLink, ReplacesAnOldLinkOnly) {
  fs::create_symlink("/dev/pts/999999", link_);
  auto first = Pty::Create(link_.string());
  ASSERT_TRUE(first.ok());
  fs::remove(link_);
  const auto second = Pty::Create(link_.string());
  ASSERT_TRUE(second.ok());
  first->Unplug();
  EXPECT_EQ(fs::read_symlink(link_), second->slave_path()) << "the link is no longer the first's";

  std::ofstream(folder_ / "file") << "precious";
  const auto third = Pty::Create((folder_ / "file").string());
  ASSERT_FALSE(third.ok());
  EXPECT_NE(third.error().find("is no link"), std::string::npos);
  EXPECT_EQ(fs::file_size(folder_ / "file"), 8U);
}

TEST_F(PtyLink, OfARunningTwinIsNotTaken) {
  const auto first = Pty::Create(link_.string());
  ASSERT_TRUE(first.ok());
  const auto second = Pty::Create(link_.string());
  ASSERT_FALSE(second.ok());
  EXPECT_EQ(second.error(), link_.string() + " is a link to " + first->slave_path() +
                                ", which is served by this program itself; end it first, or "
                                "choose another path");
  EXPECT_EQ(fs::read_symlink(link_), first->slave_path());
  EXPECT_EQ(std::distance(fs::directory_iterator(folder_), {}), 1) << "nothing is left behind";
}

/// A twin that was killed leaves its link, and the kernel gives the number to the next terminal.
TEST_F(PtyLink, ToANumberThatWasGivenAwayAgainIsReplaced) {
  const auto stranger = Pty::Create();
  ASSERT_TRUE(stranger.ok());
  fs::create_symlink(stranger->slave_path(), link_);
  const timespec before[2] = {{1, 0}, {1, 0}};
  ASSERT_EQ(utimensat(AT_FDCWD, link_.c_str(), before, AT_SYMLINK_NOFOLLOW), 0);
  const auto pty = Pty::Create(link_.string());
  ASSERT_TRUE(pty.ok()) << pty.error();
  EXPECT_EQ(fs::read_symlink(link_), pty->slave_path());
}

TEST_F(PtyLink, LinksToAnythingElseAreLeftAlone) {
  fs::create_symlink("/dev/ttyUSB0", link_);
  const auto pty = Pty::Create(link_.string());
  ASSERT_FALSE(pty.ok());
  EXPECT_NE(pty.error().find("which is no pty"), std::string::npos);
  EXPECT_EQ(fs::read_symlink(link_), "/dev/ttyUSB0");
}

TEST_F(PtyLink, MissingFolderIsAnError) {
  const auto pty = Pty::Create((folder_ / "none" / "line").string());
  ASSERT_FALSE(pty.ok());
  EXPECT_NE(pty.error().find("cannot make the link"), std::string::npos);
}

TEST(Pty, PassesEveryByteUntouched) {
  const auto pty = Pty::Create();
  ASSERT_TRUE(pty.ok());
  const int slave = open(pty->path().c_str(), O_RDWR | O_NOCTTY);
  const std::string sent("\x00\x03\x04\x0A\x0D\x11\x13\x1A\x7F\xFF", 10);
  ASSERT_EQ(write(pty->master(), sent.data(), sent.size()), 10);
  char got[16];
  ASSERT_EQ(read(slave, got, sizeof got), 10);
  EXPECT_EQ(std::string(got, 10), sent);
  close(slave);
}

TEST(Pty, ALeavingReaderDoesNotHangUpTheTwin) {
  const auto pty = Pty::Create();
  close(open(pty->path().c_str(), O_RDWR | O_NOCTTY));
  char byte = 0;
  EXPECT_EQ(read(pty->master(), &byte, 1), -1);
  EXPECT_EQ(errno, EAGAIN);
}

TEST(Pty, UnplugHangsUpTheReader) {
  auto pty = Pty::Create();
  const int slave = open(pty->path().c_str(), O_RDWR | O_NOCTTY);
  pty->Unplug();
  EXPECT_EQ(pty->master(), -1);
  char byte = 0;
  EXPECT_LE(read(slave, &byte, 1), 0);
  close(slave);
}

TEST(Pty, MovesWithoutClosing) {
  auto made = Pty::Create();
  const int master = made->master();
  const Pty moved = std::move(*made);
  EXPECT_EQ(made->master(), -1);
  EXPECT_EQ(moved.master(), master);
  EXPECT_NE(fcntl(master, F_GETFD), -1);
}

}  // namespace
}  // namespace baudgate
