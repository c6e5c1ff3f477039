// SPDX-License-Identifier: Apache-2.0
#include "gateway/lines/line_reporter.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "gateway/bus/exchange/line.h"
#include "gateway/lines/lines.h"
#include "gateway/lines/server_connection.h"
#include "tests/support/toy_protocol.h"
#include "tests/support/virtual_line.h"

namespace baudgate::lines {
namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;
using What = bus::News::What;

config::Config ConfigOfFive() {
  config::Config config;
  std::vector<config::Device> devices;
  for (const char address : {'A', 'B', 'C', 'D', 'E'}) {
    devices.push_back(ToyDevice(std::string(1, address), std::string(1, address), {"1"}));
  }
  config.lines.push_back(ToyLine(std::move(devices)));
  return config;
}

class LineReporterTest : public ::testing::Test, private bus::EventSink {
 protected:
  void State(bus::DeviceState from, bus::DeviceState to, std::uint32_t device = 3) {
    reporter_.OnDeviceState(device, from, to, "no reply", now_);
  }
  std::vector<std::string> TakeTold() { return std::exchange(told_, {}); }

  config::Config config_ = ConfigOfFive();
  bus::PointStore store_{config_};
  records::LineRecorder recorder_{config_.lines[0], 0, {}};
  Now now_{};
  LineReporter reporter_{config_.lines[0], store_, recorder_, nullptr, this};

 private:
  void OnReported(bus::ReportedEvents) override {}
  void OnDrained(std::uint32_t, Instant) override {}
  void OnRead(std::uint32_t, std::span<const std::uint32_t>, Now) override {}
  void OnNews(const config::Line&, const bus::News& news, Now) override {
    told_.push_back(std::to_string(static_cast<int>(news.what)) + (news.first ? " first" : "") +
                    (news.over ? " over" : "") +
                    (news.device ? " of " + std::to_string(*news.device) : "") +
                    (news.text.empty() ? "" : ": " + news.text));
  }

  std::vector<std::string> told_;
};

TEST_F(LineReporterTest, ReportsADeviceThatGoesOfflineAndReturns) {
  State(bus::DeviceState::never_seen, bus::DeviceState::online);
  State(bus::DeviceState::online, bus::DeviceState::degraded);
  EXPECT_THAT(TakeTold(), ElementsAre("0 first over of 3")) << "nothing has happened yet";
  State(bus::DeviceState::degraded, bus::DeviceState::offline);
  State(bus::DeviceState::offline, bus::DeviceState::online);
  EXPECT_THAT(TakeTold(), ElementsAre("0 of 3: no reply", "0 over of 3"));
  State(bus::DeviceState::never_seen, bus::DeviceState::offline, 4);
  EXPECT_THAT(TakeTold(), ElementsAre("0 of 4: no reply")) << "it has never answered";
  State(bus::DeviceState::online, bus::DeviceState::offline, bus::kFirstSlave + 7);
  EXPECT_THAT(TakeTold(), IsEmpty()) << "of a route, no device";
}

/// While the port is closed, the devices are offline without a report, so their first answers are
/// not reported either.
TEST_F(LineReporterTest, ReportsALostPortOnceAndNotItsDevices) {
  reporter_.OnNews({What::port_down, false, {}, "unplugged"}, now_);
  reporter_.OnNews({What::port_down, false, {}, "no such file"}, now_);
  reporter_.OnNews({What::port_down, true, {}, "/dev/x"}, now_);
  State(bus::DeviceState::offline, bus::DeviceState::online);
  reporter_.OnNews({What::port_down, true, {}, "/dev/x"}, now_);
  EXPECT_THAT(TakeTold(), ElementsAre("4: unplugged", "4 over: /dev/x", "0 first over of 3"));
}

TEST_F(LineReporterTest, ReportsEveryTroubleOfAWrongDevice) {
  reporter_.OnNews({What::wrong_device, false, 3, "type 0D"}, now_);
  reporter_.OnNews({What::wrong_device, false, 3, "type 0E"}, now_);
  reporter_.OnNews({What::wrong_device, true, 3, ""}, now_);
  reporter_.OnNews({What::replaced, false, 3, "a"}, now_);
  reporter_.OnNews({What::replaced, false, 3, "b"}, now_);
  EXPECT_THAT(TakeTold(), ElementsAre("2 of 3: type 0D", "2 of 3: type 0E", "2 over of 3",
                                      "3 of 3: a", "3 of 3: b"));
}

TEST_F(LineReporterTest, ReportsADeviceTakenOutOfUse) {
  State(bus::DeviceState::online, bus::DeviceState::disabled);
  State(bus::DeviceState::disabled, bus::DeviceState::online);
  EXPECT_THAT(TakeTold(),
              ElementsAre("1 of 3: no reply", "1 over of 3: no reply", "0 first over of 3"));
  State(bus::DeviceState::disabled, bus::DeviceState::never_seen, 4);
  EXPECT_THAT(TakeTold(), ElementsAre("1 first over of 4: no reply")) << "by the configuration";
}

TEST_F(LineReporterTest, ReportsNothingOfAnAbandonedLine) {
  reporter_.OnNews({What::port_down, false, {}, "unplugged"}, now_);
  EXPECT_THAT(TakeTold(), ElementsAre("4: unplugged"));
  reporter_.Retire();
  reporter_.OnNews({What::port_down, true, {}, "/dev/x"}, now_);
  State(bus::DeviceState::online, bus::DeviceState::offline);
  EXPECT_THAT(TakeTold(), IsEmpty()) << "a new line has its name";
}

TEST_F(LineReporterTest, EventsAreStoredWhenTheLatestBatchIsStored) {
  EXPECT_TRUE(reporter_.TakeKept(3, false)) << "told before the start";
  reporter_.OnEvents({.device = 3});
  EXPECT_FALSE(reporter_.TakeKept(3, false));
  EXPECT_TRUE(reporter_.TakeKept(4, false));
  EXPECT_TRUE(reporter_.TakeKept(3, true));
  EXPECT_TRUE(reporter_.TakeKept(3, false));
}

const Instant kOpened{100s};

TEST(ConnectionProof, ALocalPortWorksAsSoonAsItIsOpen) {
  ConnectionProof proof(false);
  EXPECT_TRUE(proof.OnOpened(kOpened));
  EXPECT_FALSE(proof.check_at());
  EXPECT_TRUE(proof.OnLost());
  EXPECT_TRUE(proof.OnOpened(kOpened));
}

TEST(ConnectionProof, BytesProveAConnectionOnlyAfterTheTimeOfAGreeting) {
  const struct {
    Duration first;
    Duration lost;
    bool worked;
  } rows[] = {{100ms, 300ms, false}, {100ms, 600ms, true}, {600ms, 700ms, true}};
  for (const auto& row : rows) {
    ConnectionProof proof(true);
    proof.OnOpened(kOpened);
    bool proven = proof.NoteBytes(kOpened + row.first);
    EXPECT_EQ(proven, row.first >= 500ms);
    if (row.lost >= 500ms && !proven) proven = proof.OnCheck(*proof.check_at(), false);
    EXPECT_EQ(proven, row.worked);
    EXPECT_EQ(proof.OnLost(), row.worked);
  }
}

TEST(ConnectionProof, AnUnansweredConnectionIsProvenAfterThirtySeconds) {
  ConnectionProof proof(true);
  proof.OnOpened(kOpened);
  Duration held{};
  while (!proof.OnCheck(*proof.check_at(), false)) {
    held = *proof.check_at() - kOpened;
    ASSERT_LE(held, 40s);
  }
  EXPECT_GE(held, 30s);
}

TEST(ConnectionProof, AfterAUselessConnectionTheNextIsNewsOnceItIsProven) {
  ConnectionProof proof(true);
  EXPECT_TRUE(proof.OnOpened(kOpened));
  EXPECT_FALSE(proof.OnLost());
  EXPECT_FALSE(proof.OnOpened(kOpened + 1s));
  EXPECT_TRUE(proof.Prove());
  EXPECT_TRUE(proof.TakeNews());
  EXPECT_FALSE(proof.TakeNews()) << "once";
  EXPECT_FALSE(proof.Prove());
  EXPECT_TRUE(proof.OnLost());
}

TEST(ConnectionProof, AfterALoanTheConnectionIsCheckedAgain) {
  ConnectionProof proof(true);
  proof.OnOpened(kOpened);
  proof.NoteBytes(kOpened + 1s);
  proof.Pause();
  EXPECT_FALSE(proof.check_at());
  proof.GoOn(kOpened + 60s);
  EXPECT_EQ(proof.check_at(), kOpened + 60500ms);
  EXPECT_TRUE(proof.OnLost());
}

class Watched : public testing::Test {
 protected:
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
  void LookQuietly(int times) {
    for (int i = 0; i < times; ++i) EXPECT_TRUE(Look().empty()) << i;
  }

  LoopWatch watch_;
  WallTime now_ = WallTime{} + 1h;
  Loop modbus_;
  Loop line_;
};

TEST_F(Watched, AHangingLineIsNamedAndDoesNotStopTheSignOfLife) {
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

TEST_F(Watched, AHangingRequiredLoopStopsTheSignOfLife) {
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

TEST_F(Watched, AClockJumpIsNoHang) {
  watch_.Add("line bay", 0, line_.ask());
  LookQuietly(1);
  now_ += 24h;
  LookQuietly(1);
  line_.Run();
  LookQuietly(1);
}

TEST_F(Watched, AnAnswerMayComeAfterTheWatchHasEnded) {
  auto watch = std::make_unique<LoopWatch>();
  watch->Add("line bay", 0, line_.ask());
  (void)watch->Look(now_);
  watch.reset();
  line_.Run();
}

}  // namespace
}  // namespace baudgate::lines
