// Tests of `RecordService`, which reads points when an event happens. The device answers some reads
// only, or late.
// SPDX-License-Identifier: Apache-2.0
#include "gateway/records/events/record_service.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <optional>
#include <utility>

#include "gateway/records/events/event_file.h"
#include "gateway/records/events/event_source.h"
#include "gateway/records/events/own_records.h"
#include "gateway/records/events/record_table.h"
#include "tests/gateway/records/audit/fixture.h"

namespace baudgate::events {
namespace {

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
                      [this](bus::WriteCommand command) {
                        if (takes_) asked_.push_back(std::move(command));
                        return takes_;
                      },
                  .keep = [this](KeptRecord record) { kept_.push_back(std::move(record)); }}) {}

  void SetUp() override {
    for (std::uint32_t line = 0; line < config_.lines.size(); ++line) {
      service_.Add(store_.LineAt(line));
    }
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
    const bus::Sample sample{point, value, quality};
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
  void Hear(Duration later) {
    Pass(later);
    service_.OnRead(0, now_.instant);
  }

  Now now_{Instant(1h), WallTime(std::chrono::hours(498'000))};
  const config::Config config_;
  bus::PointStore store_{config_};
  std::vector<bus::WriteCommand> asked_;
  bool takes_ = true;
  std::vector<KeptRecord> kept_;
  RecordService service_;
};

TEST_F(RecordServiceTest, StoresARecordWhenNoFurtherEventFollows) {
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

TEST_F(RecordServiceTest, ACheckForEventsBeforeTheReadProvesNothing) {
  Owe(1);
  const Instant before = now_.instant;
  ReadAll();
  service_.OnDrained(0, before);
  EXPECT_THAT(kept_, IsEmpty());
  Drain();
  EXPECT_THAT(kept_, SizeIs(1));
}

TEST_F(RecordServiceTest, AFurtherEventSupersedesTheRecordOfThePrevious) {
  Owe(412);
  ReadAll(5);
  Owe(413);
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

TEST_F(RecordServiceTest, ARecordReadDuringTheNextEventIsReadAgain) {
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

TEST_F(RecordServiceTest, AnIncompleteRecordIsNotStored) {
  Read(2, 3);
  Owe(412);
  for (int i = 1; i < RecordService::kTries; ++i) {
    Read(0, 1);
    Answer({.reason = "not all values of the record could be read"});
    Drain();
    EXPECT_THAT(kept_, IsEmpty());
    Hear(1s);
    EXPECT_THAT(asked_, IsEmpty()) << "not at once";
    Hear(RecordService::kAgain);
  }
  Read(0, 1);
  Answer({.reason = "not all values of the record could be read"});
  ASSERT_THAT(kept_, SizeIs(1));
  EXPECT_EQ(kept_[0].state, RecordState::not_read);
  EXPECT_EQ(kept_[0].text, "not all values of the record could be read");
  EXPECT_THAT(kept_[0].values, IsEmpty());
}

TEST_F(RecordServiceTest, WaitsForAnOfflineDevice) {
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

TEST_F(RecordServiceTest, WaitsWhileAnotherDeviceAnswers) {
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

TEST_F(RecordServiceTest, AMissingItemOfTheDeviceIsNotAwaited) {
  Read(2, 0, {Quality::bad_configuration, Reason::not_fitted});
  Owe(412);
  Read(0, 5);
  Answer({.reason = "not all values of the record could be read"});
  Drain();
  ASSERT_THAT(kept_, SizeIs(1));
  EXPECT_EQ(kept_[0].state, RecordState::read);
  EXPECT_FALSE(HasValue(kept_[0].values.at(1).value));
  EXPECT_EQ(kept_[0].values.at(1).quality, Quality::bad_configuration);
}

TEST_F(RecordServiceTest, WithoutProofOfNoFurtherEventTheRecordIsUncertain) {
  Owe(412);
  ReadAll();
  Hear(RecordService::kUnproven);
  ASSERT_THAT(kept_, SizeIs(1));
  EXPECT_EQ(kept_[0].state, RecordState::read);
  EXPECT_EQ(kept_[0].values.at(0).quality, Quality::uncertain);
  EXPECT_NE(kept_[0].text, "");
}

TEST_F(RecordServiceTest, ARemovedRecordIsReportedAsNotRead) {
  service_.Owe(
      {{7, "bay-1", "feeder-1", "gone", {}, {}}, {8, "bay-1", "feeder-9", "trip", {}, {}}});
  EXPECT_THAT(asked_, IsEmpty());
  ASSERT_THAT(kept_, SizeIs(2));
  EXPECT_EQ(kept_[0].state, RecordState::not_read);
  EXPECT_EQ(kept_[1].event, 8);
}

TEST_F(RecordServiceTest, NoDeviceIsReadBeforeTheLinesHaveStarted) {
  RecordService early(store_,
                      {.clocks = [this] { return now_; },
                       .ask =
                           [this](bus::WriteCommand command) {
                             asked_.push_back(std::move(command));
                             return true;
                           },
                       .keep = [this](KeptRecord record) { kept_.push_back(std::move(record)); }});
  early.Add(store_.LineAt(0));
  early.Owe({{412, "bay-1", "feeder-1", "trip", {}, {}}});
  early.OnRead(0, now_.instant);
  EXPECT_THAT(asked_, IsEmpty());
  early.Start();
  EXPECT_THAT(asked_, SizeIs(1));
  Answer({.end = WriteEnd::not_sent});
}

TEST_F(RecordServiceTest, AfterAReloadThePendingRecordHasTheNewDeviceNumber) {
  Owe(412);
  Answer({.end = WriteEnd::not_sent, .reason = "the line has ended"});
  const config::Line again = config_.lines[0];
  store_.Retire(0);
  service_.Owe({{413, "bay-1", "feeder-1", "trip", now_.wall, events::ClockQuality::device}});
  EXPECT_THAT(kept_, SizeIs(1)) << "412 is superseded, 413 waits for its device";
  store_.Append(std::make_shared<const config::Line>(again));
  service_.Add(std::make_shared<const config::Line>(again));
  service_.TakeOver();
  EXPECT_THAT(asked_, IsEmpty()) << "the relay may have more to tell";
  service_.OnDrained(1, now_.instant);
  ASSERT_THAT(asked_, SizeIs(1));
  EXPECT_EQ(asked_[0].device, 1U);
  for (const std::uint32_t point : {0U, 2U}) {
    Pass(100ms);
    const bus::Sample sample{point, 5.0, Quality::good};
    store_.Update(1, std::span(&sample, 1), now_, 1ms);
  }
  Answer();
  Pass(1s);
  service_.OnDrained(1, now_.instant);
  ASSERT_THAT(kept_, SizeIs(2));
  EXPECT_EQ(kept_[1].event, 413);
  EXPECT_EQ(kept_[1].state, RecordState::read);
}

TEST_F(RecordServiceTest, AfterAReloadWithoutTheDeviceItsRecordIsNotRead) {
  Owe(412);
  Answer({.end = WriteEnd::not_sent, .reason = "the line has ended"});
  store_.Retire(0);
  service_.TakeOver();
  ASSERT_THAT(kept_, SizeIs(1));
  EXPECT_EQ(kept_[0].state, RecordState::not_read);
  EXPECT_THAT(kept_[0].text, HasSubstr("no longer has this record of the device"));
}

TEST_F(RecordServiceTest, AnAnswerOfARemovedDeviceIsIgnored) {
  Owe(412);
  store_.Retire(0);
  service_.TakeOver();
  store_.Forget(0);
  Answer();
  EXPECT_THAT(asked_, IsEmpty());
  EXPECT_THAT(kept_, SizeIs(1));
}

class SilentServiceTest : public RecordServiceTest {
 protected:
  SilentServiceTest() : RecordServiceTest(false) {}
};

TEST_F(SilentServiceTest, ADeviceWithoutEventsNeedsNoProofOfNoFurtherEvent) {
  Owe(412);
  ReadAll();
  EXPECT_THAT(kept_, SizeIs(1));
}

}  // namespace
}  // namespace baudgate::events

namespace baudgate::events {
namespace {

using config::EventState;

const WallTime kAt(1'790'000'000s);

TEST(OwnRecords, DescribeTheConditionOfALine) {
  struct Row {
    Fact fact;
    std::uint32_t code;
    EventState state;
    const char* text;
  };
  const Row rows[] = {
      {{OwnCode::port_down, false, "b", "", "unplugged"},
       1000005,
       EventState::on,
       "port down: unplugged"},
      {{OwnCode::port_down, true, "b"}, 1000005, EventState::off, "port open again"},
      {{OwnCode::port_lent, false, "b"}, 1000006, EventState::on, "port lent to another program"},
      {{OwnCode::port_lent, true, "b"}, 1000006, EventState::off, "port taken back"},
      {{OwnCode::collisions, false, "b"}, 1000007, EventState::on, "collisions"},
      {{OwnCode::collisions, true, "b"}, 1000007, EventState::off, "no collisions for a minute"},
      {{OwnCode::ring_open, false, "b"}, 1000008, EventState::on, "the ring is open"},
      {{OwnCode::ring_open, true, "b"}, 1000008, EventState::off, "the ring is closed again"},
      {{OwnCode::no_answer, false, "b", "d", "time is up"},
       1000009,
       EventState::on,
       "does not answer: time is up"},
      {{OwnCode::no_answer, true, "b", "d"}, 1000009, EventState::off, "answers again"},
      {{OwnCode::not_in_use, false, "b", "d", "taken out of use"},
       1000010,
       EventState::on,
       "taken out of use"},
      {{OwnCode::not_in_use, true, "b", "d"}, 1000010, EventState::off, "in use again"},
      {{OwnCode::wrong_device, false, "b", "d"},
       1000011,
       EventState::on,
       "does not match the configuration"},
      {{OwnCode::wrong_device, true, "b", "d"},
       1000011,
       EventState::off,
       "matches the configuration again"},
      {{OwnCode::replaced, false, "b", "d", "7 for 8"},
       1000012,
       EventState::message,
       "another device: 7 for 8"},
      {{OwnCode::clock_corrected, false, "b", "d", "it was 5.0 s ahead"},
       1000020,
       EventState::message,
       "clock corrected: it was 5.0 s ahead"},
      {{OwnCode::clock_left, false, "b", "d", "why"},
       1000021,
       EventState::message,
       "clock not corrected: why"},
  };
  for (const Row& row : rows) {
    const EventRecord record = FactRecord(row.fact, kAt);
    EXPECT_EQ(record.code, row.code);
    EXPECT_EQ(record.state, row.state) << row.text;
    EXPECT_EQ(record.text, row.text);
    EXPECT_EQ(record.line, "b");
    EXPECT_EQ(record.device, row.fact.device);
    EXPECT_EQ(record.clock, ClockQuality::gateway);
    EXPECT_EQ(record.received, kAt);
    EXPECT_EQ(record.device_time, kAt);
  }
}

TEST(OwnRecords, DescribeStartAndEndOfTheGateway) {
  using End = LastRun::End;
  EXPECT_EQ(StartRecord("1", {}, kAt).text, "baudgate 1 has started");
  EXPECT_EQ(StartRecord("1", {End::in_order, kAt}, kAt).text,
            "baudgate 1 has started; the previous run was stopped normally");
  EXPECT_EQ(
      StartRecord("1", {End::broken_off, kAt}, kAt).text,
      "baudgate 1 has started; the previous run ended unexpectedly after " + FormatWallTime(kAt));
  EXPECT_EQ(StartRecord("1", {}, kAt).code, 1000001U);
  EXPECT_EQ(EndRecord(kAt).code, 1000002U);
  EXPECT_EQ(EndRecord(kAt).text, "the gateway ends");
  const EventRecord trouble = DiskTroubleRecord("/a/events.db", "/a/events.db: full", kAt, kAt);
  EXPECT_EQ(trouble.code, 1000004U);
  EXPECT_EQ(trouble.text, "no event could be stored since " + FormatWallTime(kAt) + ": full");
}

TEST(OwnRecords, DescribeTheStatesOfAnAlarm) {
  Alarm alarm;
  alarm.line = "b";
  alarm.device = "d";
  alarm.name = "current above 5";
  alarm.text = "current 8: above 5";
  alarm.seq = 7;
  const EventRecord seen = AckRecord(alarm, {.seqs = {7}, .by = "user:anna"}, kAt);
  EXPECT_EQ(seen.code, 1000016U);
  EXPECT_EQ(seen.text, "acknowledged by user:anna: current 8: above 5");
  EXPECT_EQ(seen.subject, alarm.name);
  EXPECT_EQ(seen.mark.step, AlarmMark::Step::acknowledge);
  EXPECT_EQ(seen.mark.by, "user:anna");
  EXPECT_EQ(seen.mark.seq, 7);
  const EventRecord gone = NotWatchedRecord(alarm, kAt);
  EXPECT_EQ(gone.code, 1000017U);
  EXPECT_EQ(gone.state, EventState::off);
  EXPECT_EQ(gone.text, "the configuration no longer has this alarm: current 8: above 5");
  EXPECT_EQ(gone.mark.step, AlarmMark::Step::clear);
  EXPECT_EQ(gone.line + "." + gone.device, "b.d");
}

TEST(OwnRecords, AreCutToTheStoredLength) {
  const Fact fact{OwnCode::port_down, false, "b", "", std::string(500, 'x')};
  EXPECT_EQ(FactRecord(fact, kAt).text.size(), kLongestText);
}

using ::testing::ElementsAre;

class RecordTest : public audit::FolderTest {
 protected:
  RecordTest() { Reopen(); }

  std::filesystem::path path() const { return file(); }
  EventFile::Opened Reopen() {
    file_.emplace(path());
    auto opened = file_->Open();
    EXPECT_TRUE(opened && opened->ok);
    return std::move(*opened);
  }
  static EventRecord Event(std::int64_t seq, const std::string& record = {}) {
    EventRecord event;
    event.seq = seq;
    event.received = event.device_time = audit::kWall;
    event.clock = ClockQuality::device;
    event.line = "bay-1";
    event.device = "feeder-1";
    event.code = 3;
    event.text = "tripped";
    event.record = record;
    return event;
  }
  static KeptRecord Trip(std::int64_t event) {
    KeptRecord record;
    record.kind = kEventRecord;
    record.line = "bay-1";
    record.device = "feeder-1";
    record.name = "trip";
    record.event = event;
    record.device_time = audit::kWall;
    record.clock = ClockQuality::device;
    record.read = audit::kWall + 1s;
    record.values = {{"trip_phases", std::int64_t{4}, "", Quality::good},
                     {"current_l1", 5.25, "xIn", Quality::uncertain},
                     {"type", std::string("SPCJ"), "", Quality::good},
                     {"gone", {}, "xIn", {Quality::bad_configuration, Reason::not_fitted}}};
    return record;
  }
  static KeptRecord Billing(int month) {
    KeptRecord record;
    record.kind = kBillingRecord;
    record.line = "meters";
    record.device = "meter-1";
    record.name = "month";
    record.device_time = WallTime(std::chrono::sys_days(std::chrono::year(2026) / month / 1));
    record.clock = ClockQuality::device;
    record.read = audit::kWall;
    record.values = {{"energy_t1", 812.4, "kWh", Quality::good}};
    return record;
  }
  Page Events() {
    auto page = ReadPage(path(), {});
    EXPECT_TRUE(page) << page.error();
    return page ? *page : Page{};
  }
  RecordPage Records(const RecordQuery& query) {
    auto page = ReadRecords(path(), query);
    EXPECT_TRUE(page) << page.error();
    return page ? *page : RecordPage{};
  }

  std::optional<EventFile> file_;
};

TEST_F(RecordTest, IsPendingOverARestartAndThenStoredWithItsEvent) {
  ASSERT_TRUE(file_->Write({{0, "a", false, {Event(1), Event(2, "trip")}}}));
  EXPECT_EQ(Events().records[1].record, "trip");
  EXPECT_FALSE(Events().records[1].kept);
  const auto owed = Reopen().contents.owed;
  ASSERT_EQ(owed.size(), 1U);
  EXPECT_EQ(owed[0].event, 2);
  EXPECT_EQ(owed[0].device, "feeder-1");
  EXPECT_EQ(owed[0].name, "trip");
  EXPECT_EQ(owed[0].device_time, audit::kWall);
  EXPECT_EQ(owed[0].clock, ClockQuality::device);

  ASSERT_TRUE(file_->Write({}, nullptr, {Trip(2)}));
  EXPECT_TRUE(Reopen().contents.owed.empty());
  const auto records = Events().records;
  EXPECT_EQ(records[0].record, "");
  ASSERT_TRUE(records[1].kept);
  const KeptRecord& kept = *records[1].kept;
  EXPECT_EQ(kept.seq, 1);
  EXPECT_EQ(kept.state, RecordState::read);
  EXPECT_EQ(kept.read, audit::kWall + 1s);
  ASSERT_EQ(kept.values.size(), 4U);
  EXPECT_EQ(kept.values[0].name, "trip_phases");
  EXPECT_EQ(ToText(kept.values[0].value), "4");
  EXPECT_EQ(ToText(kept.values[1].value), "5.25");
  EXPECT_EQ(kept.values[1].unit, "xIn");
  EXPECT_EQ(kept.values[1].quality, Quality::uncertain);
  EXPECT_EQ(ToText(kept.values[2].value), "SPCJ");
  EXPECT_FALSE(HasValue(kept.values[3].value));
  EXPECT_EQ(kept.values[3].quality, (Quality{Quality::bad_configuration, Reason::not_fitted}));
}

TEST_F(RecordTest, IsStoredWithItsEventInOneTransaction) {
  EventRecord tag = Event(1, "tag");
  tag.kept = Trip(0);
  tag.kept->name = "tag";
  ASSERT_TRUE(file_->Write({{0, "a", false, {tag}}}));
  const auto records = Events().records;
  ASSERT_TRUE(records[0].kept);
  EXPECT_EQ(records[0].kept->name, "tag");
  EXPECT_EQ(records[0].kept->event, 1);
  EXPECT_TRUE(Reopen().contents.owed.empty());
}

TEST_F(RecordTest, EachKindHasItsOwnNumbersAndEachRecordIsStoredOnce) {
  ASSERT_TRUE(file_->Write({}, nullptr, {Billing(1), Billing(2), Billing(1)}));
  ASSERT_TRUE(file_->Write({{0, "a", false, {Event(1, "trip")}}}, nullptr, {Trip(1)}));
  ASSERT_TRUE(file_->Write({}, nullptr, {Billing(2), Billing(3)}));
  std::vector<std::int64_t> numbers;
  for (const KeptRecord& record : Records({.kind = std::string(kBillingRecord)}).records) {
    numbers.push_back(record.seq);
    EXPECT_EQ(record.values.size(), 1U);
  }
  EXPECT_THAT(numbers, ElementsAre(1, 2, 3));
  EXPECT_EQ(Records({.kind = std::string(kEventRecord)}).records.size(), 1U);
  const auto one = Records({.kind = std::string(kBillingRecord),
                            .device = "meter-1",
                            .since = Billing(2).device_time,
                            .until = Billing(3).device_time});
  ASSERT_EQ(one.records.size(), 1U);
  EXPECT_EQ(one.records[0].seq, 2);
  EXPECT_FALSE(one.more);
}

TEST_F(RecordTest, IsDeletedWithItsEvent) {
  records::OpenedEvents opened = records::OpenEvents(path());
  ASSERT_TRUE(opened.database);
  EventTable table(*opened.database, 2);
  ASSERT_TRUE(
      table.Write({{0, "a", false, {Event(1, "trip"), Event(2, "trip")}}}, nullptr, {Trip(1)}));
  ASSERT_TRUE(table.Write({{0, "b", false, {Event(3), Event(4)}}}));
  EXPECT_TRUE(Records({.kind = std::string(kEventRecord)}).records.empty());
  EXPECT_TRUE(Reopen().contents.owed.empty());
  EXPECT_EQ(ToText(opened.database->First("SELECT count(*) FROM record_values")), "0");
}

TEST_F(RecordTest, APageOfEventsWithManyValuesIsShorter) {
  std::vector<EventRecord> events;
  for (std::int64_t seq = 1; seq <= 10; ++seq) {
    EventRecord event = Event(seq, "trip");
    event.kept = Trip(seq);
    event.kept->values.assign(kPageValues / 4, {"v", 1.0, "", Quality::good});
    events.push_back(event);
  }
  ASSERT_TRUE(file_->Write({{0, "a", false, events}}));
  const Page page = Events();
  EXPECT_EQ(page.records.size(), 4U);
  EXPECT_EQ(page.next, 4);
  EXPECT_TRUE(page.more);
  const auto rest = ReadPage(path(), {.after = 8});
  ASSERT_TRUE(rest);
  EXPECT_EQ(rest->records.size(), 2U);
  EXPECT_FALSE(rest->more);
}

}  // namespace
}  // namespace baudgate::events
