// Tests of the path of events from lines to the file.
// SPDX-License-Identifier: Apache-2.0
#include "gateway/records/event_path.h"

#include <gmock/gmock.h>

#include <filesystem>
#include <thread>

#include "gateway/records/events/own_records.h"
#include "tests/support/journald.h"

namespace baudgate::records {
namespace {

using config::EventState;
using events::OwnCode;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

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
    place_.file = folder_ / "events.db";
    path_ = std::make_unique<EventPath>(config_, store_, place_, commands_,
                                        [](std::uint32_t, const std::string&, bool) {});
  }
  void Tell(bus::News news) { path_->OnNews(config_.lines[0], news, now_); }
  void ReadAs(double value, Quality quality = Quality::good) {
    now_.instant += 1s;
    now_.wall += 1s;
    const bus::Sample sample{0, value, quality};
    store_.Update(device_, std::span(&sample, 1), now_, 1ms);
    const std::uint32_t point = 0;
    path_->OnRead(device_, std::span(&point, 1), now_);
  }
  std::vector<events::EventRecord> Await(std::int64_t count) {
    while (path_->log().state().newest < count) std::this_thread::yield();
    return path_->log().Read({})->records;
  }

  struct Commands final : bus::CommandSink {
    bool Submit(bus::WriteCommand) override { return false; }
  };

  Commands commands_;
  std::uint32_t device_ = 0;
  const config::Config config_ = RelayConfig();
  std::vector<std::shared_ptr<const config::Config>> reloaded_;
  bus::PointStore store_{config_};
  std::filesystem::path folder_;
  EventsPlace place_;
  std::unique_ptr<EventPath> path_;
  Now now_{Instant() + 1h, WallTime(1'790'000'000s)};
};

TEST_F(EventPathTest, RecordsHaveCodesAndTexts) {
  Tell({bus::News::What::port_down, false, {}, "unplugged"});
  Tell({bus::News::What::no_answer, true, 0U});
  Tell({bus::News::What::replaced, false, 0U, "it is another"});
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

TEST_F(EventPathTest, PointEventsUseTheQualityOfTheStore) {
  ReadAs(1);
  store_.SetOverride(0, Quality(Quality::bad_device_failure));
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
  Tell({bus::News::What::port_down, false, {}, "end"});
  EXPECT_EQ(Await(2)[1].text, "port down: end") << "the alarm was there before";
  ReadAs(3);
  EXPECT_EQ(Await(3)[2].text, "current 3: above 5, over");
  EXPECT_EQ(path_->log().Alarms()[0].state, events::AlarmState::returned);
}

TEST_F(EventPathTest, AlarmsGoToTheJournalWithTheirFields) {
  const Journald journald;
  journald.TakeLog();
  Tell({bus::News::What::no_answer, false, 0U, "no reply"});
  const auto look = [&] { path_->Look({}, now_); };
  now_.instant += 29s;
  look();
  now_.instant += 1s;
  look();
  const auto next = [&] {
    std::string message;
    while (message.empty()) message = journald.Next();
    return message;
  };
  EXPECT_EQ(next(),
            "MESSAGE=line bay-1: device feeder-1: alarm active, priority medium: no answer for "
            "30s: no reply\nPRIORITY=4\nSYSLOG_IDENTIFIER=baudgate\nLINE=bay-1\nDEVICE=feeder-1\n"
            "ALARM=no answer\nPRIORITY_OF_ALARM=medium\nSTATE=active\nSEQ=2\n");
  path_->log().Acknowledge({.line = "bay-1", .device = "feeder-1", .by = "user:anna"},
                           [](const events::Acknowledged&) {});
  EXPECT_THAT(next(), HasSubstr("no reply (user:anna)\nPRIORITY=6\n"));
  Tell({bus::News::What::no_answer, true, 0U});
  EXPECT_THAT(next(), HasSubstr("\nALARM=no answer\nPRIORITY_OF_ALARM=medium\nSTATE=normal\n"));
  Tell({bus::News::What::replaced, false, 0U, "it is another"});
  const std::string raised = next();
  EXPECT_THAT(raised, HasSubstr("alarm active, priority medium: another device: it is another\n"
                                "PRIORITY=4\n"));
  EXPECT_THAT(raised, HasSubstr("\nSTATE=active\n"));
  const std::string over = next();
  EXPECT_THAT(over, HasSubstr("alarm returned, priority medium: another device: it is another\n"
                              "PRIORITY=6\n"))
      << "what is over is no warning";
  EXPECT_THAT(over, HasSubstr("\nSTATE=returned\n"));
  log::SetLeast(log::Level::error);
}

TEST_F(EventPathTest, WithoutEventsAlarmsAreInMemory) {
  place_.in_memory = true;
  path_.reset();
  std::filesystem::remove(folder_ / "events.db");
  const config::Config bare = [&] {
    config::Config config = config_;
    config.events.given = false;
    return config;
  }();
  EventsPlace place;
  place.in_memory = true;
  EventPath path(bare, store_, place, commands_, [](std::uint32_t, const std::string&, bool) {});
  path.OnNews(bare.lines[0], {bus::News::What::port_down, false, {}, "unplugged"}, now_);
  path.Look({}, now_);
  now_.instant += 30s;
  path.Look({}, now_);
  while (path.log().Alarms().empty()) std::this_thread::yield();
  const events::Alarm alarm = path.log().Alarms()[0];
  EXPECT_EQ(PlaceOf(alarm), "bay-1");
  EXPECT_EQ(alarm.text, "port down for 30s: unplugged");
  EXPECT_EQ(alarm.seq, 1) << "nothing else is told";
  std::string trouble = "not done";
  path.log().Acknowledge({.seqs = {alarm.seq}, .by = "user:anna"},
                         [&](const events::Acknowledged& done) { trouble = done.trouble; });
  while (path.log().Alarms()[0].state != events::AlarmState::acknowledged) {
    std::this_thread::yield();
  }
  EXPECT_EQ(path.feed()->alarms().Take(0, 10).size(), 1U) << "outputs see it";
  EXPECT_TRUE(path.log().state().in_memory);
  EXPECT_FALSE(path.log().Read({})) << "there are no events to be read";
  path.OnNews(bare.lines[0], {bus::News::What::port_down, true, {}, ""}, now_);
  while (!path.log().Alarms().empty()) std::this_thread::yield();
  EXPECT_TRUE(std::filesystem::is_empty(folder_));
}

TEST_F(EventPathTest, AStoredAlarmEndsAtTheFirstAnswerAfterARestart) {
  Tell({bus::News::What::no_answer, false, 0U, "no reply"});
  path_->Look({}, now_);
  now_.instant += 30s;
  path_->Look({}, now_);
  Await(2);
  Start();
  Tell({.what = bus::News::What::no_answer, .over = true, .device = 0U, .first = true});
  const auto records = Await(3);
  ASSERT_EQ(records.size(), 3U);
  EXPECT_EQ(records[1].code, events::CodeOf(OwnCode::own_alarm));
  EXPECT_EQ(records[2].text, "no answer, over");
  EXPECT_EQ(path_->log().Alarms().at(0).state, events::AlarmState::returned);
}

/// A reload restarts the line, so the new line has no record of earlier reports.
class EventReloadTest : public EventPathTest {
 protected:
  void Reload(const std::function<void(config::Line& line)>& change = {}) {
    auto next = std::make_shared<config::Config>(*running_);
    if (change) change(next->lines[0]);
    running_ = reloaded_.emplace_back(next);
    const std::shared_ptr<const config::Line> begun(next, next->lines.data());
    store_.Append(begun);
    path_->Renumber(next, std::span(&begun, 1));
    ++device_;
  }
  void Begin(bus::News::What what) { Told({what, false, DeviceOf(what), "why"}); }
  void End(bus::News::What what, bool first) {
    Told({.what = what, .over = true, .device = DeviceOf(what), .first = first});
  }
  std::vector<std::string> Records() {
    path_->OnReload(false, std::to_string(++asked_));
    std::vector<std::string> all;
    for (std::string last; last != std::to_string(asked_); std::this_thread::yield()) {
      all.clear();
      const auto page = path_->log().Read({});
      for (const auto& record : page->records) {
        last = record.text;
        if (record.code == events::CodeOf(OwnCode::reloaded)) continue;
        all.push_back(std::to_string(record.code) + " " + std::string(Name(record.state)) + " " +
                      record.text);
      }
    }
    return all;
  }

 private:
  std::optional<std::uint32_t> DeviceOf(bus::News::What what) const {
    return what < bus::News::What::port_down ? std::optional(device_) : std::nullopt;
  }
  void Told(const bus::News& news) { path_->OnNews(running_->lines[0], news, now_); }

  std::shared_ptr<const config::Config> running_ = std::make_shared<config::Config>(config_);
  int asked_ = 0;
};

TEST_F(EventReloadTest, AWatchedPointKeepsItsStateOverAReload) {
  const std::string on = "1000014 on current 9: above 5";
  const std::string off = "1000014 off current 1: above 5, over";
  Reload([](config::Line& line) {
    line.devices[0].points[0].events[0].alarm = config::AlarmPriority::none;
  });
  ReadAs(9);
  Reload();
  ReadAs(9);
  EXPECT_THAT(Records(), ElementsAre(on));
  Reload();
  ReadAs(1);
  EXPECT_THAT(Records(), ElementsAre(on, off));
  ReadAs(9);
  Reload([](config::Line& line) { line.devices[0].points[0].events[0].value = 8; });
  ReadAs(9);
  EXPECT_THAT(Records(), ElementsAre(on, off, on, "1000014 on current 9: above 8"))
      << "another rule begins anew";
}

TEST_F(EventReloadTest, AReportedTroubleEndsOverAReload) {
  using What = bus::News::What;
  for (const What what : {What::port_down, What::port_lent, What::no_answer}) Begin(what);
  Reload();
  Begin(What::port_down);
  Reload();
  for (const What what : {What::port_down, What::port_lent, What::no_answer}) End(what, true);
  EXPECT_THAT(
      Records(),
      ElementsAre("1000005 on port down: why", "1000006 on port lent to another program: why",
                  "1000009 on does not answer: why", "1000005 off port open again",
                  "1000006 off port taken back", "1000009 off answers again"));
}

TEST_F(EventReloadTest, TroublesOfARestartedLineEndWithAReload) {
  using What = bus::News::What;
  for (const What what : {What::collisions, What::ring_open, What::wrong_device}) Begin(what);
  Reload();
  Begin(What::wrong_device);
  const std::string end = ": it is unknown whether this has ended; a reload has restarted the line";
  EXPECT_THAT(Records(),
              ElementsAre("1000007 on collisions: why", "1000008 on the ring is open: why",
                          "1000011 on does not match the configuration: why",
                          "1000007 off collisions" + end, "1000008 off the ring is open" + end,
                          "1000011 off does not match the configuration" + end,
                          "1000011 on does not match the configuration: why"));
}

TEST_F(EventReloadTest, TheUseOfADeviceIsReportedOverAReload) {
  const auto enable = [](bool enabled) {
    return [enabled](config::Line& line) { line.devices[0].enabled = enabled; };
  };
  const std::string on = "1000010 on taken out of use: why";
  const std::string by_reload = "1000010 off in use again: by a reload";
  const std::string by_hand = "1000010 off in use again";
  Begin(bus::News::What::not_in_use);
  Reload();
  Begin(bus::News::What::not_in_use);
  EXPECT_THAT(Records(), ElementsAre(on)) << "it still is";
  Reload(enable(false));
  Reload(enable(true));
  End(bus::News::What::not_in_use, true);
  EXPECT_THAT(Records(), ElementsAre(on, by_reload));
  Reload(enable(false));
  End(bus::News::What::not_in_use, true);
  EXPECT_THAT(Records(), ElementsAre(on, by_reload, by_hand));
  Reload();
  End(bus::News::What::not_in_use, true);
  EXPECT_THAT(Records(), ElementsAre(on, by_reload, by_hand)) << "it was in use before as well";
}

}  // namespace
}  // namespace baudgate::records
