// SPDX-License-Identifier: Apache-2.0
#include "gateway/lines/line_reporter.h"

#include <gmock/gmock.h>

#include <string>
#include <vector>

#include "gateway/bus/exchange/line.h"
#include "tests/support/toy_protocol.h"
#include "tests/support/virtual_line.h"

namespace baudgate {
namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;
using What = News::What;

config::Config ConfigOfFive() {
  config::Config config;
  std::vector<config::Device> devices;
  for (const char address : {'A', 'B', 'C', 'D', 'E'}) {
    devices.push_back(ToyDevice(std::string(1, address), std::string(1, address), {"1"}));
  }
  config.lines.push_back(ToyLine(std::move(devices)));
  return config;
}

class LineReporterTest : public ::testing::Test, private EventSink {
 protected:
  void State(DeviceState from, DeviceState to, std::uint32_t device = 3) {
    reporter_.OnDeviceState(device, from, to, "no reply", now_);
  }
  std::vector<std::string> TakeTold() { return std::exchange(told_, {}); }

  config::Config config_ = ConfigOfFive();
  PointStore store_{config_};
  LineRecorder recorder_{config_.lines[0], 0, {}};
  Now now_{};
  LineReporter reporter_{config_.lines[0], store_, recorder_, nullptr, this};

 private:
  void OnReported(ReportedEvents) override {}
  void OnDrained(std::uint32_t, Instant) override {}
  void OnRead(std::uint32_t, std::span<const std::uint32_t>, Now) override {}
  void OnNews(const config::Line&, const News& news, Now) override {
    told_.push_back(std::to_string(static_cast<int>(news.what)) + (news.first ? " first" : "") +
                    (news.over ? " over" : "") +
                    (news.device ? " of " + std::to_string(*news.device) : "") +
                    (news.text.empty() ? "" : ": " + news.text));
  }

  std::vector<std::string> told_;
};

TEST_F(LineReporterTest, TellsOfADeviceThatGoesAndComes) {
  State(DeviceState::never_seen, DeviceState::online);
  State(DeviceState::online, DeviceState::degraded);
  EXPECT_THAT(TakeTold(), ElementsAre("0 first over of 3")) << "nothing has happened yet";
  State(DeviceState::degraded, DeviceState::offline);
  State(DeviceState::offline, DeviceState::online);
  EXPECT_THAT(TakeTold(), ElementsAre("0 of 3: no reply", "0 over of 3"));
  State(DeviceState::never_seen, DeviceState::offline, 4);
  EXPECT_THAT(TakeTold(), ElementsAre("0 of 4: no reply")) << "it has never answered";
  State(DeviceState::online, DeviceState::offline, kFirstSlave + 7);
  EXPECT_THAT(TakeTold(), IsEmpty()) << "of a route, no device";
}

/// Behind a closed port all devices are offline, which nobody tells: their first answers are news
/// for the log, but no events.
TEST_F(LineReporterTest, TellsOfAPortAndNotOfAllBehindIt) {
  reporter_.OnNews({What::port_down, false, {}, "unplugged"}, now_);
  reporter_.OnNews({What::port_down, false, {}, "no such file"}, now_);
  reporter_.OnNews({What::port_down, true, {}, "/dev/x"}, now_);
  State(DeviceState::offline, DeviceState::online);
  reporter_.OnNews({What::port_down, true, {}, "/dev/x"}, now_);
  EXPECT_THAT(TakeTold(), ElementsAre("4: unplugged", "4 over: /dev/x", "0 first over of 3"));
}

TEST_F(LineReporterTest, TellsEveryTroubleOfAWrongDevice) {
  reporter_.OnNews({What::wrong_device, false, 3, "type 0D"}, now_);
  reporter_.OnNews({What::wrong_device, false, 3, "type 0E"}, now_);
  reporter_.OnNews({What::wrong_device, true, 3, ""}, now_);
  reporter_.OnNews({What::replaced, false, 3, "a"}, now_);
  reporter_.OnNews({What::replaced, false, 3, "b"}, now_);
  EXPECT_THAT(TakeTold(), ElementsAre("2 of 3: type 0D", "2 of 3: type 0E", "2 over of 3",
                                      "3 of 3: a", "3 of 3: b"));
}

TEST_F(LineReporterTest, TellsOfADeviceOutOfUse) {
  State(DeviceState::online, DeviceState::disabled);
  State(DeviceState::disabled, DeviceState::online);
  EXPECT_THAT(TakeTold(),
              ElementsAre("1 of 3: no reply", "1 over of 3: no reply", "0 first over of 3"));
  State(DeviceState::disabled, DeviceState::never_seen, 4);
  EXPECT_THAT(TakeTold(), ElementsAre("1 first over of 4: no reply")) << "by the configuration";
}

TEST_F(LineReporterTest, OneOfAnAbandonedLineTellsNothing) {
  reporter_.OnNews({What::port_down, false, {}, "unplugged"}, now_);
  EXPECT_THAT(TakeTold(), ElementsAre("4: unplugged"));
  reporter_.Retire();
  reporter_.OnNews({What::port_down, true, {}, "/dev/x"}, now_);
  State(DeviceState::online, DeviceState::offline);
  EXPECT_THAT(TakeTold(), IsEmpty()) << "a new line has its name";
}

/// What a restart has found in the file is not news of what the device has told since.
TEST_F(LineReporterTest, EventsAreKeptWhenTheLatestOnesAre) {
  EXPECT_TRUE(reporter_.TakeKept(3, false)) << "told before the start";
  reporter_.OnEvents({.device = 3});
  EXPECT_FALSE(reporter_.TakeKept(3, false));
  EXPECT_TRUE(reporter_.TakeKept(4, false));
  EXPECT_TRUE(reporter_.TakeKept(3, true));
  EXPECT_TRUE(reporter_.TakeKept(3, false));
}

}  // namespace
}  // namespace baudgate
