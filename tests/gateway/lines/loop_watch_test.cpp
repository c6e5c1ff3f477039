// Which loops still run, by looks that the test makes and loops that answer when it lets them.
// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include "gateway/lines/lines.h"

namespace baudgate {
namespace {

class Watched : public testing::Test {
 protected:
  /// A loop that has not come to what it was asked yet.
  struct Loop {
    std::vector<std::function<void()>> waiting;
    LoopWatch::Ask ask() {
      return [this](std::function<void()> sign) { waiting.push_back(std::move(sign)); };
    }
    void Run() {
      for (const auto& each : std::exchange(waiting, {})) each();
    }
  };

  std::vector<LoopWatch::Change> Look() { return watch_.Look(now_ += 1s); }
  /// So often, and each time without news.
  void LookQuietly(int times) {
    for (int i = 0; i < times; ++i) EXPECT_TRUE(Look().empty()) << i;
  }

  LoopWatch watch_;
  WallTime now_ = WallTime{} + 1h;
  Loop modbus_;
  Loop line_;
};

TEST_F(Watched, ALineThatHangsIsNamedAndKeepsNothingBack) {
  watch_.Add("modbus", {}, modbus_.ask());
  watch_.Add("line bay", 3, line_.ask());
  const WallTime asked = now_ + 1s;
  LookQuietly(1);
  for (int i = 1; i < LoopWatch::kStuckAfter; ++i) {
    modbus_.Run();
    LookQuietly(1);
    EXPECT_TRUE(watch_.complete());
  }
  modbus_.Run();
  const auto changes = Look();
  ASSERT_EQ(changes.size(), 1U);
  EXPECT_EQ(changes[0].loop, "line bay");
  EXPECT_EQ(changes[0].line, 3U);
  EXPECT_EQ(changes[0].stuck_since, asked);
  EXPECT_TRUE(watch_.complete());
  EXPECT_EQ(line_.waiting.size(), 1U) << "asked once, however long it hangs";

  modbus_.Run();
  LookQuietly(1);
  modbus_.Run();
  line_.Run();
  const auto again = Look();
  ASSERT_EQ(again.size(), 1U);
  EXPECT_EQ(again[0].line, 3U);
  EXPECT_FALSE(again[0].stuck_since);
}

TEST_F(Watched, WithoutOneThatAllNeedThereIsNoSignOfLife) {
  watch_.Add("modbus", {}, modbus_.ask());
  LookQuietly(1);
  EXPECT_TRUE(watch_.complete());
  LookQuietly(1);
  EXPECT_FALSE(watch_.complete()) << "at the first look without an answer";
  modbus_.Run();
  LookQuietly(1);
  EXPECT_TRUE(watch_.complete()) << "a late answer is one";
  LookQuietly(LoopWatch::kStuckAfter - 1);
  const auto changes = Look();
  ASSERT_EQ(changes.size(), 1U);
  EXPECT_EQ(changes[0].loop, "modbus");
  EXPECT_FALSE(changes[0].line);
}

/// Nobody looked while the machine slept.
TEST_F(Watched, ALeapOfTheClockIsNoHang) {
  watch_.Add("line bay", 0, line_.ask());
  LookQuietly(1);
  now_ += 24h;
  LookQuietly(1);
  line_.Run();
  LookQuietly(1);
}

TEST_F(Watched, AnAnswerMayComeWhenNobodyWatchesAnyMore) {
  auto watch = std::make_unique<LoopWatch>();
  watch->Add("line bay", 0, line_.ask());
  (void)watch->Look(now_);
  watch.reset();
  line_.Run();
}

}  // namespace
}  // namespace baudgate
