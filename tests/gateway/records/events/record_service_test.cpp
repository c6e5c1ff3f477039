// What events owe, read once and whole: with a device that answers in part, late, or not at all,
// and tells of another event meanwhile.
// SPDX-License-Identifier: Apache-2.0
#include "gateway/records/events/record_service.h"

#include <gmock/gmock.h>

#include <utility>

namespace baudgate {
namespace {

using events::KeptRecord;
using events::RecordState;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::SizeIs;

config::Config FeederConfig(bool tells_events) {
  config::Config config;
  config::Line line;
  line.name = "bay-1";
  config::Device device;
  device.name = "feeder-1";
  device.events = tells_events;
  for (const char* name : {"phases", "other", "current"}) {
    config::Point point;
    point.name = name;
    point.unit = "xIn";
    device.points.push_back(point);
  }
  device.records = {{"trip", {0, 2}}};
  line.devices = {device};
  config.lines = {line};
  return config;
}

class RecordServiceTest : public ::testing::Test {
 protected:
  explicit RecordServiceTest(bool tells_events = true)
      : config_(FeederConfig(tells_events)),
        service_(store_,
                 {.clocks = [this] { return now_; },
                  .ask =
                      [this](WriteCommand command) {
                        if (takes_) asked_.push_back(std::move(command));
                        return takes_;
                      },
                  .keep = [this](KeptRecord record) { kept_.push_back(std::move(record)); }}) {}

  void SetUp() override {
    for (const config::Line& line : config_.lines) service_.Add(line);
    service_.Start();
  }
  void Owe(std::int64_t event) {
    service_.Owe({{event, "bay-1", "feeder-1", "trip", now_.wall, events::ClockQuality::device}});
    service_.OnDrained(0, now_.instant);
  }
  void Pass(Duration time) {
    now_.instant += time;
    now_.wall += time;
  }
  void Read(std::uint32_t point, double value, Quality quality = Quality::good) {
    Pass(100ms);
    const Sample sample{point, value, quality};
    store_.Update(0, std::span(&sample, 1), now_, 1ms);
  }
  void Answer(WriteResult result = {.read_back = true}) {
    ASSERT_THAT(asked_, SizeIs(1));
    Pass(10ms);
    const auto done = std::exchange(asked_, {}).front().done;
    done(result);
  }
  void ReadAll(double value = 5) {
    Read(0, value);
    Read(2, value);
    Answer();
  }
  void Drain() {
    Pass(1s);
    service_.OnDrained(0, now_.instant);
  }
  /// The device has answered something.
  void Hear(Duration later) {
    Pass(later);
    service_.OnRead(0, now_.instant);
  }

  Now now_{Instant(1h), WallTime(std::chrono::hours(498'000))};
  const config::Config config_;
  PointStore store_{config_};
  std::vector<WriteCommand> asked_;
  bool takes_ = true;
  std::vector<KeptRecord> kept_;
  RecordService service_;
};

TEST_F(RecordServiceTest, ReadsAllBehindTheEventAndKeepsItWhenNothingElseHasHappened) {
  Owe(412);
  ASSERT_THAT(asked_, SizeIs(1));
  EXPECT_THAT(asked_[0].reads(), ElementsAre(0U, 2U));
  EXPECT_THAT(asked_[0].writes(), IsEmpty());
  ReadAll();
  EXPECT_THAT(kept_, IsEmpty()) << "another event may have come before it was read";
  const WallTime read = now_.wall;
  Drain();
  ASSERT_THAT(kept_, SizeIs(1));
  const KeptRecord& record = kept_[0];
  EXPECT_EQ(record.kind, "event");
  EXPECT_EQ(record.event, 412);
  EXPECT_EQ(record.device, "feeder-1");
  EXPECT_EQ(record.name, "trip");
  EXPECT_EQ(record.read, read);
  EXPECT_EQ(record.state, RecordState::read);
  ASSERT_THAT(record.values, SizeIs(2));
  EXPECT_EQ(record.values[0].name, "phases");
  EXPECT_EQ(record.values[0].value, Value(5.0));
  EXPECT_EQ(record.values[0].quality, Quality::good);
  EXPECT_EQ(record.values[1].unit, "xIn");
  Hear(1h);
  Drain();
  EXPECT_THAT(asked_, IsEmpty());
  EXPECT_THAT(kept_, SizeIs(1));
}

TEST_F(RecordServiceTest, ALookForEventsBeforeItWasReadProvesNothing) {
  Owe(1);
  const Instant before = now_.instant;
  ReadAll();
  service_.OnDrained(0, before);
  EXPECT_THAT(kept_, IsEmpty());
  Drain();
  EXPECT_THAT(kept_, SizeIs(1));
}

TEST_F(RecordServiceTest, TheNextEventGetsTheValuesThatItMayHaveChanged) {
  Owe(412);
  ReadAll(5);
  Owe(413);  // told by the relay before it had nothing more
  ASSERT_THAT(kept_, SizeIs(1));
  ASSERT_THAT(asked_, SizeIs(1)) << "it is read once more";
  ReadAll(7);
  Drain();
  ASSERT_THAT(kept_, SizeIs(2));
  EXPECT_EQ(kept_[0].event, 412);
  EXPECT_EQ(kept_[0].state, RecordState::superseded);
  EXPECT_THAT(kept_[0].values, IsEmpty());
  EXPECT_THAT(kept_[0].text, HasSubstr("event 413"));
  EXPECT_EQ(kept_[1].event, 413);
  EXPECT_EQ(kept_[1].values.at(0).value, Value(7.0));
}

TEST_F(RecordServiceTest, WhatIsReadWhileTheNextEventComesIsReadAgain) {
  Owe(412);
  Owe(413);
  ReadAll(5);
  EXPECT_THAT(asked_, IsEmpty()) << "the relay may have more to tell";
  Drain();
  ASSERT_THAT(asked_, SizeIs(1));
  ReadAll(7);
  Drain();
  ASSERT_THAT(kept_, SizeIs(2));
  EXPECT_EQ(kept_[1].values.at(0).value, Value(7.0));
}

TEST_F(RecordServiceTest, APartIsNone) {
  Read(2, 3);
  Owe(412);
  for (int i = 1; i < RecordService::kTries; ++i) {
    Read(0, 1);
    Answer({.reason = "not all was answered"});
    Drain();
    EXPECT_THAT(kept_, IsEmpty());
    Hear(1s);
    EXPECT_THAT(asked_, IsEmpty()) << "not at once";
    Hear(RecordService::kAgain);
  }
  Read(0, 1);
  Answer({.reason = "not all was answered"});
  ASSERT_THAT(kept_, SizeIs(1));
  EXPECT_EQ(kept_[0].state, RecordState::not_read);
  EXPECT_EQ(kept_[0].text, "not all was answered");
  EXPECT_THAT(kept_[0].values, IsEmpty());
}

TEST_F(RecordServiceTest, WaitsForADeviceThatIsAway) {
  takes_ = false;
  Owe(412);
  takes_ = true;
  for (int i = 0; i < 2 * RecordService::kTries; ++i) {
    Hear(RecordService::kAgain);
    Answer({.end = WriteEnd::not_sent, .reason = "the device is offline"});
  }
  EXPECT_THAT(kept_, IsEmpty());
  Hear(1h);
  ReadAll();
  Drain();
  ASSERT_THAT(kept_, SizeIs(1));
  EXPECT_EQ(kept_[0].state, RecordState::read);
}

TEST_F(RecordServiceTest, WaitsWhileAnotherDeviceAnswersInItsPlace) {
  Owe(412);
  store_.SetOverride(0, Quality(Quality::bad_configuration, Reason::other_module));
  for (int i = 0; i < 2 * RecordService::kTries; ++i) {
    Read(0, 1);
    Read(2, 1);
    Answer();
    Hear(RecordService::kAgain);
  }
  EXPECT_THAT(kept_, IsEmpty());
  store_.SetOverride(0, {});
  ReadAll();
  Drain();
  ASSERT_THAT(kept_, SizeIs(1));
  EXPECT_EQ(kept_[0].state, RecordState::read);
}

TEST_F(RecordServiceTest, AnItemThatTheDeviceDoesNotHaveIsNotWaitedFor) {
  Read(2, 0, {Quality::bad_configuration, Reason::not_fitted});
  Owe(412);
  Read(0, 5);
  Answer({.reason = "not all was answered"});
  Drain();
  ASSERT_THAT(kept_, SizeIs(1));
  EXPECT_EQ(kept_[0].state, RecordState::read);
  EXPECT_FALSE(HasValue(kept_[0].values.at(1).value));
  EXPECT_EQ(kept_[0].values.at(1).quality, Quality::bad_configuration);
}

TEST_F(RecordServiceTest, WithoutAWordThatThereIsNothingElseItIsUncertain) {
  Owe(412);
  ReadAll();
  Hear(RecordService::kUnproven);
  ASSERT_THAT(kept_, SizeIs(1));
  EXPECT_EQ(kept_[0].state, RecordState::read);
  EXPECT_EQ(kept_[0].values.at(0).quality, Quality::uncertain);
  EXPECT_NE(kept_[0].text, "");
}

TEST_F(RecordServiceTest, WhatIsNotConfiguredAnyMoreIsTold) {
  service_.Owe(
      {{7, "bay-1", "feeder-1", "gone", {}, {}}, {8, "bay-1", "feeder-9", "trip", {}, {}}});
  EXPECT_THAT(asked_, IsEmpty());
  ASSERT_THAT(kept_, SizeIs(2));
  EXPECT_EQ(kept_[0].state, RecordState::not_read);
  EXPECT_EQ(kept_[1].event, 8);
}

TEST_F(RecordServiceTest, NobodyIsAskedBeforeTheLinesAreThere) {
  RecordService early(store_,
                      {.clocks = [this] { return now_; },
                       .ask =
                           [this](WriteCommand command) {
                             asked_.push_back(std::move(command));
                             return true;
                           },
                       .keep = [this](KeptRecord record) { kept_.push_back(std::move(record)); }});
  early.Add(config_.lines[0]);
  early.Owe({{412, "bay-1", "feeder-1", "trip", {}, {}}});
  early.OnRead(0, now_.instant);
  EXPECT_THAT(asked_, IsEmpty());
  early.Start();
  EXPECT_THAT(asked_, SizeIs(1));
  Answer({.end = WriteEnd::not_sent});
}

TEST_F(RecordServiceTest, AfterAReloadTheDeviceOwesItUnderItsNewNumber) {
  Owe(412);
  Answer({.end = WriteEnd::not_sent, .reason = "the line has ended"});
  const config::Line again = config_.lines[0];
  store_.Retire(0);
  service_.Owe({{413, "bay-1", "feeder-1", "trip", now_.wall, events::ClockQuality::device}});
  EXPECT_THAT(kept_, SizeIs(1)) << "412 is superseded, 413 waits for its device";
  store_.Append(again);
  service_.Add(again);
  service_.TakeOver();
  EXPECT_THAT(asked_, IsEmpty()) << "the relay may have more to tell";
  service_.OnDrained(1, now_.instant);
  ASSERT_THAT(asked_, SizeIs(1));
  EXPECT_EQ(asked_[0].device, 1U);
  for (const std::uint32_t point : {0U, 2U}) {
    Pass(100ms);
    const Sample sample{point, 5.0, Quality::good};
    store_.Update(1, std::span(&sample, 1), now_, 1ms);
  }
  Answer();
  Pass(1s);
  service_.OnDrained(1, now_.instant);
  ASSERT_THAT(kept_, SizeIs(2));
  EXPECT_EQ(kept_[1].event, 413);
  EXPECT_EQ(kept_[1].state, RecordState::read);
}

TEST_F(RecordServiceTest, AfterAReloadWithoutTheDeviceItIsNotRead) {
  Owe(412);
  Answer({.end = WriteEnd::not_sent, .reason = "the line has ended"});
  store_.Retire(0);
  service_.TakeOver();
  ASSERT_THAT(kept_, SizeIs(1));
  EXPECT_EQ(kept_[0].state, RecordState::not_read);
  EXPECT_THAT(kept_[0].text, HasSubstr("no such record of this device any more"));
}

class SilentServiceTest : public RecordServiceTest {
 protected:
  SilentServiceTest() : RecordServiceTest(false) {}
};

TEST_F(SilentServiceTest, ADeviceWithoutEventsOfItsOwnHasNothingMoreToTell) {
  Owe(412);
  ReadAll();
  EXPECT_THAT(kept_, SizeIs(1));
}

}  // namespace
}  // namespace baudgate
