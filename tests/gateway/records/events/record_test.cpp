// Values that belong together: in the file as one, with their numbers, owed and settled.
// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>

#include <optional>

#include "gateway/records/events/event_file.h"
#include "gateway/records/events/event_source.h"
#include "gateway/records/events/record_table.h"
#include "tests/gateway/records/audit/fixture.h"

namespace baudgate::events {
namespace {

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

TEST_F(RecordTest, IsOwedOverARestartAndThenStandsWithItsEvent) {
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

TEST_F(RecordTest, ComesWithItsEventInOneTransaction) {
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

TEST_F(RecordTest, EachKindHasNumbersOfItsOwnAndEachRecordIsThereOnce) {
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

TEST_F(RecordTest, GoesWithItsEvent) {
  OpenedEvents opened = OpenEvents(path());
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
