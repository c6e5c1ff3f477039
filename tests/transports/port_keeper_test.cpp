// When a port is tried again, on a real folder.
// SPDX-License-Identifier: Apache-2.0
#include "transports/port_keeper.h"

#include <gtest/gtest.h>
#include <stdlib.h>
#include <sys/stat.h>

#include <filesystem>
#include <fstream>
#include <optional>

#include "tests/transports/far_end.h"

namespace baudgate {
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

TEST_F(PortKeeperTest, APortWithoutRightsIsTriedWhenTheyChange) {
  Make(port_);
  EXPECT_TRUE(keeper_->OnDown("permission denied"));
  EXPECT_EQ(Tries(), 0);
  chmod(port_.c_str(), 0600);
  EXPECT_EQ(Tries(), 1);
}

TEST_F(PortKeeperTest, APortThatIsThereIsTriedStepByStep) {
  Make(port_);
  EXPECT_TRUE(keeper_->OnDown("busy"));
  EXPECT_TRUE(IsTried()) << "without any news of its file";
}

TEST_F(PortKeeperTest, AServerIsNeverAbsent) {
  Keep("tcp://127.0.0.1:1");
  EXPECT_TRUE(keeper_->OnDown("refused"));
  EXPECT_TRUE(IsTried());
}

TEST_F(PortKeeperTest, OneTroubleIsOneNews) {
  EXPECT_TRUE(keeper_->OnDown("absent"));
  EXPECT_FALSE(keeper_->OnDown("absent"));
  EXPECT_TRUE(keeper_->OnDown("busy"));
  keeper_->OnOpened();
  EXPECT_TRUE(keeper_->OnDown("busy"));
}

/// It may refuse, reset and close in turns, and accepts now and then without serving.
TEST_F(PortKeeperTest, ATroubleOfAServerIsNewsOnceUntilItHasWorked) {
  Keep("tcp://127.0.0.1:1");
  EXPECT_TRUE(keeper_->OnDown("closed"));
  EXPECT_TRUE(keeper_->OnDown("reset"));
  keeper_->OnOpened();
  EXPECT_FALSE(keeper_->OnDown("closed"));
  EXPECT_FALSE(keeper_->OnDown("reset"));
  keeper_->OnWorked();
  EXPECT_TRUE(keeper_->OnDown("closed"));
}

TEST_F(PortKeeperTest, AServerThatIsOnlyOpenedIsTriedLessAndLess) {
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

TEST_F(PortKeeperTest, NothingIsTriedBesideAnOpenConnection) {
  Keep("tcp://127.0.0.1:1");
  (void)keeper_->OnDown("closed");
  keeper_->OnOpened();
  PortKeeper other(io_, "tcp://127.0.0.1:1", [this] { tries_ += 100; });
  (void)other.OnDown("closed");
  ASSERT_TRUE(IsTried());
  EXPECT_EQ(Tries(), 100);
}

TEST_F(PortKeeperTest, NothingIsTriedAfterItsEnd) {
  Make(port_);
  EXPECT_TRUE(keeper_->OnDown("busy"));
  keeper_->Stop();
  chmod(port_.c_str(), 0600);
  EXPECT_EQ(Tries(), 0);
}

}  // namespace
}  // namespace baudgate
