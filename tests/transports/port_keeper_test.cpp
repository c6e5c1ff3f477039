// Tests when a lost port is tried again. The folder of the port is real.
// SPDX-License-Identifier: Apache-2.0
#include "transports/port_keeper.h"

#include <fcntl.h>
#include <gtest/gtest.h>
#include <signal.h>
#include <stdlib.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <asio/executor_work_guard.hpp>
#include <cerrno>
#include <filesystem>
#include <fstream>
#include <future>
#include <optional>
#include <string>

#include "gateway/tools/simulate/pty.h"
#include "tests/transports/far_end.h"
#include "transports/serial_port.h"

namespace baudgate::transports {
namespace {

namespace fs = std::filesystem;

class PortKeeperTest : public testing::Test {
 protected:
  PortKeeperTest() {
    std::string form = (fs::temp_directory_path() / "baudgate-keeper-XXXXXX").string();
    folder_ = mkdtemp(form.data());
    port_ = folder_ / "port";
    Keep(port_);
  }
  ~PortKeeperTest() override {
    keeper_.reset();
    fs::remove_all(folder_);
  }
  void Keep(const std::string& port) {
    keeper_.emplace(io_, port, [this] { ++tries_; });
  }
  int Tries() {
    test::RunReady(io_);
    return std::exchange(tries_, 0);
  }
  bool IsTried() {
    return test::RunUntil(io_, [this] { return tries_ > 0; });
  }
  static void Make(const fs::path& file) { std::ofstream(file) << "x"; }

  asio::io_context io_;
  fs::path folder_;
  fs::path port_;
  int tries_ = 0;
  std::optional<PortKeeper> keeper_;
};

TEST_F(PortKeeperTest, AnAbsentPortIsTriedAsSoonAsItAppears) {
  EXPECT_TRUE(keeper_->OnDown("absent"));
  EXPECT_EQ(Tries(), 0);
  Make(port_);
  EXPECT_EQ(Tries(), 1);
}

TEST_F(PortKeeperTest, APortWithoutPermissionIsTriedWhenItsModeChanges) {
  Make(port_);
  EXPECT_TRUE(keeper_->OnDown("permission denied"));
  EXPECT_EQ(Tries(), 0);
  chmod(port_.c_str(), 0600);
  EXPECT_EQ(Tries(), 1);
}

TEST_F(PortKeeperTest, AnExistingPortIsRetriedByTimer) {
  Make(port_);
  EXPECT_TRUE(keeper_->OnDown("busy"));
  EXPECT_TRUE(IsTried()) << "without any news of its file";
}

TEST_F(PortKeeperTest, AServerIsNeverAbsent) {
  Keep("tcp://127.0.0.1:1");
  EXPECT_TRUE(keeper_->OnDown("refused"));
  EXPECT_TRUE(IsTried());
}

TEST_F(PortKeeperTest, ARepeatedTroubleIsReportedOnce) {
  EXPECT_TRUE(keeper_->OnDown("absent"));
  EXPECT_FALSE(keeper_->OnDown("absent"));
  EXPECT_TRUE(keeper_->OnDown("busy"));
  keeper_->OnOpened();
  EXPECT_TRUE(keeper_->OnDown("busy"));
}

/// A serial server without a free place can refuse, reset and close in turn, and sometimes accept a
/// connection without serving it.
TEST_F(PortKeeperTest, ATroubleOfAServerIsReportedOnceUntilItHasWorked) {
  Keep("tcp://127.0.0.1:1");
  EXPECT_TRUE(keeper_->OnDown("closed"));
  EXPECT_TRUE(keeper_->OnDown("reset"));
  keeper_->OnOpened();
  EXPECT_FALSE(keeper_->OnDown("closed"));
  EXPECT_FALSE(keeper_->OnDown("reset"));
  keeper_->OnWorked();
  EXPECT_TRUE(keeper_->OnDown("closed"));
}

TEST_F(PortKeeperTest, AServerThatOpensButNeverWorksIsRetriedLessOften) {
  const std::string port = "tcp://127.0.0.1:1";
  int in_vain = 0;
  int worked = 0;
  PortKeeper taken(io_, port, [&] {
    ++in_vain;
    taken.OnOpened();
    (void)taken.OnDown("closed");
  });
  PortKeeper served(io_, port, [&] {
    ++worked;
    served.OnOpened();
    served.OnWorked();
    (void)served.OnDown("closed");
  });
  (void)taken.OnDown("closed");
  (void)served.OnDown("closed");
  ASSERT_TRUE(test::RunUntil(io_, [&] { return in_vain == 3; }));
  EXPECT_GE(worked, 5) << "in 3.5 s, a try every 0.5 s";
}

TEST_F(PortKeeperTest, NoOpenIsTriedBesideAnOpenConnection) {
  Keep("tcp://127.0.0.1:1");
  (void)keeper_->OnDown("closed");
  keeper_->OnOpened();
  PortKeeper other(io_, "tcp://127.0.0.1:1", [this] { tries_ += 100; });
  (void)other.OnDown("closed");
  ASSERT_TRUE(IsTried());
  EXPECT_EQ(Tries(), 100);
}

TEST_F(PortKeeperTest, NoOpenIsTriedAfterStop) {
  Make(port_);
  EXPECT_TRUE(keeper_->OnDown("busy"));
  keeper_->Stop();
  chmod(port_.c_str(), 0600);
  EXPECT_EQ(Tries(), 0);
}

bool Contains(const std::string& text, const std::string& part) {
  return text.find(part) != std::string::npos;
}

TEST(OpenErrorText, NamesTheRemedyOfEachError) {
  EXPECT_EQ(OpenErrorText("/dev/ttyUSB7", ENOENT),
            "no such port /dev/ttyUSB7; plug the adapter in, or correct port");
  EXPECT_TRUE(Contains(OpenErrorText("/dev/ttyUSB7", EACCES),
                       "add the user of the gateway to group "
                       "dialout"));
  EXPECT_TRUE(Contains(OpenErrorText("/dev/null", EACCES), "chgrp dialout /dev/null"))
      << "joining group root would be dangerous";
  EXPECT_TRUE(Contains(OpenErrorText("/dev/ttyS9", EIO), "hardware"));
  EXPECT_TRUE(Contains(OpenErrorText("/dev/ttyS9", EBUSY), "in use by another program"));
  EXPECT_TRUE(Contains(OpenErrorText("/dev/ttyS9", EMFILE), "/dev/ttyS9"));
}

TEST(OpenExclusive, MissingAndOtherFilesAreRefused) {
  EXPECT_TRUE(Contains(OpenExclusive("/dev/no-such-port").error(), "no such port"));
  EXPECT_TRUE(Contains(OpenExclusive("/dev/null").error(), "is not a serial port"));
  EXPECT_EQ(OpenExclusive("/dev").error(), "/dev is a folder, not a serial port; correct port");
  EXPECT_TRUE(Contains(OpenExclusive("/proc/self/status").error(), "is an ordinary file"));
}

TEST(OpenExclusive, SecondOpenOfThisProcessIsNamed) {
  const auto pty = tools::Pty::Create();
  const auto first = OpenExclusive(pty->slave_path());
  ASSERT_TRUE(first.ok()) << first.error();
  const auto second = OpenExclusive(pty->slave_path());
  ASSERT_FALSE(second.ok());
  EXPECT_TRUE(Contains(second.error(), "in use by another line of this gateway")) << second.error();

  // A port can be unlocked, and opened again, long before its first descriptor is closed.
  ReleaseLocks(*first);
  const auto third = OpenExclusive(pty->slave_path());
  EXPECT_TRUE(third.ok());
  close(*third);
  close(*first);
}

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
  const auto pty = tools::Pty::Create();
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
  /// Returns the number of changes since the last call. inotify reports a change at once, so
  /// nothing is waited for.
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

TEST_F(PortWatchTest, ReportsAPortThatIsCreatedRenamedOrGivenPermission) {
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

TEST_F(PortWatchTest, FollowsFoldersThatComeAndGo) {
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

TEST_F(PortWatchTest, FoldersAndPortCreatedAtOnceAreNotMissed) {
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

  // The adapter is plugged in again as ttyUSB1. From now on only changes of ttyUSB1 are reported.
  fs::remove(link);
  fs::create_symlink("../ttyUSB1", link);
  EXPECT_EQ(News(), 1);
  chmod((folder_ / "ttyUSB1").c_str(), 0600);
  EXPECT_EQ(News(), 1);
  chmod((folder_ / "ttyUSB0").c_str(), 0644);
  EXPECT_EQ(News(), 0);
}

TEST_F(PortWatchTest, ANewPtyIsReported) {
  const fs::path link = folder_ / "line";
  Watch(link);
  const auto pty = tools::Pty::Create(link.string());
  EXPECT_GE(News(), 1);
}

TEST_F(PortWatchTest, ACircleOfLinksIsWatchedWithoutALoop) {
  fs::create_symlink("b", folder_ / "a");
  fs::create_symlink("a", folder_ / "b");
  Watch(folder_ / "a");
  fs::remove(folder_ / "b");
  Make(folder_ / "b");
  EXPECT_GE(News(), 1);
}

TEST_F(PortWatchTest, NoNewsComesAfterStop) {
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

TEST_F(PortWatchTest, AnUnwatchableFolderIsReported) {
  PortWatch proc(io_, "/proc/self/no-such-port", [] {});
  EXPECT_FALSE(proc.Start());
  EXPECT_FALSE(proc.watching());
}

using test::RunReady;
using test::RunUntil;

struct Driver {
  std::promise<void> called;
  std::promise<void> answers;
  std::future<void> answer = answers.get_future();
  std::size_t brings = 0;  ///< how many bytes arrive once the port is open
  std::promise<void> brought;
};

class SickPort final : public Transport {
 public:
  SickPort(asio::io_context& io, TransportListener& listener, Driver& driver)
      : io_(io), listener_(listener), driver_(driver) {}

  void Open() override {
    asio::post(io_, [this] {
      driver_.called.set_value();
      driver_.answer.wait();
      open_ = true;
      listener_.OnOpened();
      for (std::size_t i = 0; i < driver_.brings; i += kRead) listener_.OnBytes(Bytes(kRead));
      driver_.brought.set_value();
    });
  }
  void Close() override { open_ = false; }
  bool is_open() const override { return open_; }
  void Send(View) override {}
  void DropUnsent() override {}
  Status Apply(const config::SerialSettings&) override { return {}; }
  Status Reset(const config::SerialSettings&) override { return {}; }
  std::string Describe() const override { return "sick"; }

 private:
  static constexpr std::size_t kRead = 4096;

  asio::io_context& io_;
  TransportListener& listener_;
  Driver& driver_;
  bool open_ = false;
};

class SerialThreadTest : public testing::Test, public PortThread::Owner {
 protected:
  SerialThreadTest() {
    const auto make = [this](asio::io_context& io, TransportListener& listener) {
      return std::make_unique<SickPort>(io, listener, driver_);
    };
    port_.emplace(io_, "/dev/sick", make, *this);
  }
  ~SerialThreadTest() override { Answer(); }

  void OnOpened(const std::string& description) override { opened_ = description; }
  void OnDown(const std::string&, bool) override {}
  void OnBytes(View bytes, Instant) override { heard_ += bytes.size(); }

  void StartAndBlock() {
    port_->Start();
    driver_.called.get_future().wait();
  }
  void Answer() {
    if (!std::exchange(answered_, true)) driver_.answers.set_value();
  }

  asio::io_context io_;
  asio::executor_work_guard<asio::io_context::executor_type> work_{io_.get_executor()};
  Driver driver_;
  bool answered_ = false;
  std::string opened_;
  std::size_t heard_ = 0;
  std::optional<PortThread> port_;
};

TEST_F(SerialThreadTest, TheEventLoopRunsWhileTheDriverBlocks) {
  StartAndBlock();
  bool served = false;
  asio::post(io_, [&] { served = true; });
  ASSERT_TRUE(RunUntil(io_, [&] { return served; }));
  EXPECT_EQ(opened_, "");
  Answer();
  ASSERT_TRUE(RunUntil(io_, [&] { return !opened_.empty(); }));
  EXPECT_EQ(opened_, "sick");
}

TEST_F(SerialThreadTest, AfterStopTheOwnerGetsNoCallbacks) {
  driver_.brings = 4096;
  StartAndBlock();
  Answer();
  port_->Stop();
  port_.reset();
  RunReady(io_);
  EXPECT_EQ(opened_, "");
  EXPECT_EQ(heard_, 0U);
}

TEST_F(SerialThreadTest, UnreadBytesTakeBoundedMemory) {
  driver_.brings = 1024 * 1024;
  StartAndBlock();
  Answer();
  driver_.brought.get_future().wait();
  RunReady(io_);
  EXPECT_EQ(heard_, 64U * 1024);
}

}  // namespace
}  // namespace baudgate::transports
