// Which news of a port are heard, on real folders and links, and which are none.
// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>
#include <stdlib.h>
#include <sys/stat.h>

#include <fstream>
#include <optional>

#include "gateway/tools/simulate/pty.h"
#include "tests/transports/far_end.h"
#include "transports/port_keeper.h"

namespace baudgate {
namespace {

namespace fs = std::filesystem;

class PortWatchTest : public testing::Test {
 protected:
  PortWatchTest() {
    std::string form = (fs::temp_directory_path() / "baudgate-watch-XXXXXX").string();
    folder_ = mkdtemp(form.data());
  }
  ~PortWatchTest() override {
    watch_.reset();
    fs::remove_all(folder_);
  }

  void Watch(const fs::path& port) {
    watch_.emplace(io_, port.string(), [this] {
      ++news_;
      if (on_news_) on_news_();
    });
    ASSERT_TRUE(watch_->Start());
  }
  /// inotify delivers before the call that caused it returns: what is not there now never comes.
  int News() {
    test::RunReady(io_);
    return std::exchange(news_, 0);
  }
  static void Make(const fs::path& file) { std::ofstream(file) << "x"; }

  asio::io_context io_;
  fs::path folder_;
  int news_ = 0;
  std::function<void()> on_news_;
  std::optional<PortWatch> watch_;
};

TEST_F(PortWatchTest, CreatedMovedThereAndGivenRights) {
  const fs::path port = folder_ / "port";
  Watch(port);
  EXPECT_EQ(News(), 0);
  Make(port);
  EXPECT_EQ(News(), 1);
  chmod(port.c_str(), 0600);
  EXPECT_EQ(News(), 1) << "udev hands the port to its group after it has made it";
  Make(folder_ / "other");
  chmod((folder_ / "other").c_str(), 0600);
  fs::remove(folder_ / "other");
  std::ofstream(port) << "written";
  EXPECT_EQ(News(), 0);
  Make(folder_ / "other");
  fs::rename(folder_ / "other", port);
  EXPECT_EQ(News(), 1);
}

TEST_F(PortWatchTest, FoldersThatComeAndGo) {
  const fs::path by_id = folder_ / "serial" / "by-id";
  Watch(by_id / "usb-x");
  for (int round = 0; round < 3; ++round) {
    fs::create_directory(folder_ / "serial");
    fs::create_directory(by_id);
    test::RunReady(io_);
    news_ = 0;
    Make(by_id / "usb-x");
    EXPECT_EQ(News(), 1) << round;
    fs::remove_all(folder_ / "serial");
    test::RunReady(io_);
    news_ = 0;
    Make(folder_ / "serial.else");
    EXPECT_EQ(News(), 0);
    fs::remove(folder_ / "serial.else");
  }
}

TEST_F(PortWatchTest, AllAtOnceIsNotMissed) {
  Watch(folder_ / "serial" / "by-id" / "usb-x");
  fs::create_directories(folder_ / "serial" / "by-id");
  Make(folder_ / "serial" / "by-id" / "usb-x");
  EXPECT_GE(News(), 1);
}

TEST_F(PortWatchTest, TheTargetOfALinkIsWatchedToo) {
  const fs::path link = folder_ / "by-id" / "usb-x";
  fs::create_directory(folder_ / "by-id");
  fs::create_symlink("../ttyUSB0", link);
  Watch(link);
  Make(folder_ / "ttyUSB0");
  EXPECT_EQ(News(), 1) << "the link was dangling";
  chmod((folder_ / "ttyUSB0").c_str(), 0600);
  EXPECT_EQ(News(), 1);
  Make(folder_ / "ttyUSB1");
  EXPECT_EQ(News(), 0);

  // The adapter is plugged in elsewhere: from now on the other number counts.
  fs::remove(link);
  fs::create_symlink("../ttyUSB1", link);
  EXPECT_EQ(News(), 1);
  chmod((folder_ / "ttyUSB1").c_str(), 0600);
  EXPECT_EQ(News(), 1);
  chmod((folder_ / "ttyUSB0").c_str(), 0644);
  EXPECT_EQ(News(), 0);
}

TEST_F(PortWatchTest, APtyIsHeardOf) {
  const fs::path link = folder_ / "line";
  Watch(link);
  const auto pty = Pty::Create(link.string());
  EXPECT_GE(News(), 1);
}

TEST_F(PortWatchTest, ACircleOfLinksEnds) {
  fs::create_symlink("b", folder_ / "a");
  fs::create_symlink("a", folder_ / "b");
  Watch(folder_ / "a");
  fs::remove(folder_ / "b");
  Make(folder_ / "b");
  EXPECT_GE(News(), 1);
}

TEST_F(PortWatchTest, StopMeansSilence) {
  Watch(folder_ / "port");
  Make(folder_ / "port");
  watch_->Stop();
  EXPECT_FALSE(watch_->watching());
  EXPECT_EQ(News(), 0);
  ASSERT_TRUE(watch_->Start());
  EXPECT_EQ(News(), 0) << "old news";
  on_news_ = [this] { watch_->Stop(); };
  chmod((folder_ / "port").c_str(), 0600);
  EXPECT_EQ(News(), 1);
  chmod((folder_ / "port").c_str(), 0644);
  EXPECT_EQ(News(), 0);
}

TEST_F(PortWatchTest, WhatCanNotBeWatchedIsSaid) {
  PortWatch proc(io_, "/proc/self/no-such-port", [] {});
  EXPECT_FALSE(proc.Start());
  EXPECT_FALSE(proc.watching());
}

}  // namespace
}  // namespace baudgate
