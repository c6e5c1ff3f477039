// What lines tell, as it stands in the file: codes, words, and points by the store's quality.
// SPDX-License-Identifier: Apache-2.0
#include "gateway/daemon/event_path.h"

#include <gmock/gmock.h>

#include <filesystem>
#include <thread>

#include "gateway/events/own_codes.h"

namespace baudgate {
namespace {

using config::EventState;
using events::OwnCode;

config::Config RelayConfig() {
  config::Config config;
  config.events.given = true;
  config::Line line;
  line.name = "bay-1";
  config::Device device;
  device.name = "feeder-1";
  device.point_events = true;
  config::Point point;
  point.name = "current";
  config::PointEvent event;
  event.on = config::PointEvent::On::above;
  event.value = 5;
  event.alarm = config::AlarmPriority::high;
  point.events = {event};
  device.points = {point};
  line.devices = {device};
  config.lines = {line};
  return config;
}

class EventPathTest : public ::testing::Test {
 protected:
  EventPathTest() {
    std::string name = "/tmp/event_path_XXXXXX";
    folder_ = ::mkdtemp(name.data());
    Start();
  }
  ~EventPathTest() override {
    path_.reset();
    std::filesystem::remove_all(folder_);
  }
  void Start() {
    path_.reset();
    path_ = std::make_unique<EventPath>(config_, store_, EventsPlace{folder_ / "events.db", "", {}},
                                        commands_, [](std::uint32_t, const std::string&, bool) {});
  }
  void Tell(News news) { path_->OnNews(config_.lines[0], news, now_); }
  void ReadAs(double value, Quality quality = Quality::good) {
    now_.instant += 1s;
    now_.wall += 1s;
    const Sample sample{0, value, quality};
    store_.Update(0, std::span(&sample, 1), now_, 1ms);
    const std::uint32_t point = 0;
    path_->OnRead(0, std::span(&point, 1), now_);
  }
  std::vector<events::EventRecord> Await(std::int64_t count) {
    while (path_->log().state().newest < count) std::this_thread::yield();
    return path_->log().Read({})->records;
  }

  struct Commands final : CommandSink {
    bool Submit(WriteCommand) override { return false; }
  };

  Commands commands_;
  const config::Config config_ = RelayConfig();
  PointStore store_{config_};
  std::filesystem::path folder_;
  std::unique_ptr<EventPath> path_;
  Now now_{Instant() + 1h, WallTime(1'790'000'000s)};
};

TEST_F(EventPathTest, HasCodesAndWords) {
  Tell({News::What::port_down, false, {}, "unplugged"});
  Tell({News::What::no_answer, true, 0U});
  Tell({News::What::replaced, false, 0U, "it is another"});
  const auto records = Await(3);
  EXPECT_EQ(records[0].code, events::CodeOf(OwnCode::port_down));
  EXPECT_EQ(records[0].line, "bay-1");
  EXPECT_EQ(records[0].device, "");
  EXPECT_EQ(records[0].state, EventState::on);
  EXPECT_EQ(records[0].text, "port down: unplugged");
  EXPECT_EQ(records[0].clock, events::ClockQuality::gateway);
  EXPECT_EQ(records[0].device_time, now_.wall);
  EXPECT_EQ(records[1].code, events::CodeOf(OwnCode::no_answer));
  EXPECT_EQ(records[1].device, "feeder-1");
  EXPECT_EQ(records[1].state, EventState::off);
  EXPECT_EQ(records[1].text, "answers again");
  EXPECT_EQ(records[2].state, EventState::message);
  EXPECT_EQ(records[2].text, "another device: it is another");
}

TEST_F(EventPathTest, OfAPointRestsOnWhatTheStoreThinksOfIt) {
  ReadAs(1);
  store_.SetOverride(0, Quality(Quality::bad_device_failure));  // another device answers
  ReadAs(9);
  store_.SetOverride(0, {});
  ReadAs(9, Quality::bad_sensor_failure);
  ReadAs(8);
  const auto records = Await(1);
  ASSERT_EQ(records.size(), 1U);
  EXPECT_EQ(records[0].text, "current 8: above 5");
  EXPECT_EQ(path_->log().Alarms().size(), 1U);
  Start();
  ReadAs(7);
  Tell({News::What::port_down, false, {}, "end"});
  EXPECT_EQ(Await(2)[1].text, "port down: end") << "the alarm was there before";
  ReadAs(3);
  EXPECT_EQ(Await(3)[2].text, "current 3: above 5, over");
  EXPECT_EQ(path_->log().Alarms()[0].state, events::AlarmState::returned);
}

}  // namespace
}  // namespace baudgate
