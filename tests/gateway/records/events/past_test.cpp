// Tests of records that a meter has stored itself, of `PlacedTime` (the minute of a time in
// seconds), and of `Shares`.
// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sqlite3.h>

#include <random>

#include "gateway/records/events/event_book.h"
#include "gateway/records/events/event_file.h"
#include "gateway/records/events/event_record.h"
#include "gateway/records/events/own_records.h"
#include "gateway/records/events/record_table.h"
#include "tests/gateway/records/audit/faulty_disk.h"
#include "tests/support/long_run.h"

namespace baudgate::events {
namespace {

using audit::FaultyDisk;

const SourceNames kMeters = {{"bay", "meter-1"}, {"bay", "meter-2"}};
constexpr Duration kSpan = 30min;

protocols::PastRecord RecordAt(std::int64_t n) {
  protocols::PastRecord record{"load_1", n * kSpan, kSpan, {}};
  record.values = {{"active_import", static_cast<double>(n), Quality::good, "kW"},
                   {"active_export", 0.5, Quality::uncertain_sub_normal, "kW"}};
  return record;
}

PastQuery QueryOf(const std::string& device = "meter-1",
                  const std::string& name = "load_1.active_import") {
  return {.line = "bay", .device = device, .name = name};
}

class Gateway {
 public:
  explicit Gateway(const FaultyDisk& disk) : file_(audit::kEventsFile, disk.vfs()) {}

  std::optional<std::string> Said(Source source) {
    const auto opened = file_.Open();
    if (opened && !opened->ok) return std::nullopt;
    if (opened) book_.OnOpened(opened->contents.last, opened->contents.said);
    return book_.said(kMeters[source]);
  }
  bool Keep(Source source, const std::string& said, std::vector<protocols::PastRecord> records) {
    const auto& [line, device] = kMeters[source];
    book_.Add({.source = source,
               .said = said,
               .past = std::move(records),
               .line = line,
               .device = device});
    const auto due = book_.Prepare();
    if (!file_.Write(due)) return false;
    book_.Kept(due.size());
    return true;
  }

 private:
  EventBook book_;
  EventFile file_;
};

std::vector<PastRow> ReadAll(const FaultyDisk& disk, PastQuery query) {
  records::Database database(audit::kEventsFile, records::Database::Mode::read, disk.vfs());
  std::vector<PastRow> rows;
  for (bool more = true; more;) {
    auto page = ReadPast(database, query);
    if (!page) {
      ADD_FAILURE() << page.error();
      break;
    }
    rows.insert(rows.end(), page->rows.begin(), page->rows.end());
    query.after = page->next;
    more = page->more;
  }
  return rows;
}

TEST(Past, RecordsAreReadBackByTheirTimes) {
  FaultyDisk disk;
  Gateway gateway(disk);
  ASSERT_TRUE(gateway.Said(0));
  std::vector<protocols::PastRecord> records;
  for (std::int64_t n = 0; n < 2500; ++n) records.push_back(RecordAt(n));
  ASSERT_TRUE(gateway.Keep(0, "2500", records));
  ASSERT_TRUE(gateway.Keep(1, "1", {RecordAt(7)}));
  const auto rows = ReadAll(disk, QueryOf());
  ASSERT_EQ(rows.size(), 2500U);
  for (std::size_t n = 0; n < rows.size(); ++n) {
    ASSERT_EQ(rows[n].time, WallTime(static_cast<std::int64_t>(n) * kSpan));
    ASSERT_EQ(rows[n].value, Value(static_cast<double>(n)));
    ASSERT_EQ(rows[n].quality, Quality(Quality::good));
    ASSERT_EQ(rows[n].span, kSpan);
  }
  EXPECT_EQ(ReadAll(disk, QueryOf("meter-2")).size(), 1U);
  EXPECT_EQ(ReadAll(disk, QueryOf("meter-1", "load_1.active_export"))[3].quality,
            Quality(Quality::uncertain_sub_normal));
  PastQuery some = QueryOf();
  some.since = WallTime(10 * kSpan);
  some.until = WallTime(12 * kSpan);
  EXPECT_EQ(ReadAll(disk, some).size(), 2U);
  records::Database database(audit::kEventsFile, records::Database::Mode::read, disk.vfs());
  EXPECT_FALSE(ReadPast(database, QueryOf("meter-1", "load_2.active_import"))->known);
  EXPECT_FALSE(ReadPast(database, QueryOf("meter-3"))->known);
}

TEST(Past, ADuplicatedHourIsStoredTwice) {
  FaultyDisk disk;
  Gateway gateway(disk);
  ASSERT_TRUE(gateway.Said(0));
  ASSERT_TRUE(gateway.Keep(0, "1", {RecordAt(5), RecordAt(6), RecordAt(5), RecordAt(6)}));
  EXPECT_EQ(ReadAll(disk, QueryOf()).size(), 4U);
}

TEST(Past, AGapAppearsInAllValuesOfTheSeries) {
  FaultyDisk disk;
  Gateway gateway(disk);
  ASSERT_TRUE(gateway.Said(0));
  ASSERT_TRUE(gateway.Keep(0, "1", {RecordAt(5)}));
  ASSERT_TRUE(gateway.Keep(0, "2", {{"load_1", 6 * kSpan, 3 * kSpan, {}}, RecordAt(9)}));
  for (const char* name : {"load_1.active_import", "load_1.active_export"}) {
    const auto rows = ReadAll(disk, QueryOf("meter-1", name));
    ASSERT_EQ(rows.size(), 3U);
    EXPECT_FALSE(rows[1].quality);
    EXPECT_EQ(rows[1].span, 3 * kSpan);
    EXPECT_EQ(rows[1].value, Value());
  }
}

TEST(Past, TheOldestRecordsAreDeletedFirst) {
  FaultyDisk disk;
  Gateway gateway(disk);
  ASSERT_TRUE(gateway.Said(0));
  records::Database database(audit::kEventsFile, records::Database::Mode::write, disk.vfs());
  PastTable table(database, 100);
  for (std::int64_t n = 0; n < 80; ++n) ASSERT_TRUE(table.Insert("bay", "meter-1", {RecordAt(n)}));
  const auto rows = ReadAll(disk, QueryOf());
  EXPECT_EQ(rows.size(), 50U);
  EXPECT_EQ(rows.back().value, Value(79.0));
}

TEST(Past, APowerCutLosesARecordTogetherWithItsReadPosition) {
  std::int64_t kept = 0;
  for (unsigned seed = 1; seed <= LongRun(60) && !testing::Test::HasFailure(); ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    std::mt19937 random(seed);
    FaultyDisk disk;
    std::int64_t promised = 0;
    for (int life = 0; life < 4; ++life) {
      {
        Gateway gateway(disk);
        disk.power_left = static_cast<int>(1 + random() % 150);
        while (!disk.power_failed()) {
          const auto said = gateway.Said(0);
          if (!said) continue;
          std::int64_t n = said->empty() ? 0 : std::stoll(*said);
          std::vector<protocols::PastRecord> records;
          for (auto more = 1 + random() % 6; more > 0; --more) records.push_back(RecordAt(n++));
          if (gateway.Keep(0, std::to_string(n), records))
            promised = n;
          else
            break;
        }
      }
      disk.Restore(random);
      Gateway gateway(disk);
      const auto said = gateway.Said(0);
      ASSERT_TRUE(said);
      const std::int64_t told = said->empty() ? 0 : std::stoll(*said);
      ASSERT_GE(told, promised);
      const auto rows = ReadAll(disk, QueryOf());
      ASSERT_EQ(rows.size(), static_cast<std::size_t>(told));
      for (std::size_t n = 0; n < rows.size(); ++n) {
        ASSERT_EQ(rows[n].time, WallTime(static_cast<std::int64_t>(n) * kSpan));
      }
      promised = told;
    }
    kept += promised;
  }
  EXPECT_GT(kept, static_cast<std::int64_t>(10 * LongRun(60))) << "else it shows little";
}

using namespace std::chrono;  // NOLINT: dates read like dates

WallTime At(sys_days day, Duration time) { return WallTime(day) + time; }
const sys_days kDay = 2026y / 11 / 23;
const sys_days kNewYear = 2027y / 1 / 1;

std::optional<protocols::SaidTime> Seconds(Duration time) {
  return protocols::SaidTime{time, 1min};
}

PlacedTime PlaceOne(Duration said, WallTime received, std::optional<Duration> oldest) {
  return Place({Seconds(said)}, received, oldest).front();
}

struct Case {
  const char* name;
  Duration said;
  WallTime received;
  std::optional<Duration> oldest;
  WallTime time;
  ClockQuality quality;
};

TEST(PlacedTime, IsCompletedFromTheTimeOfReception) {
  using Q = ClockQuality;
  const Case cases[] = {
      {"within the minute", 12'345ms, At(kDay, 10h + 13s), 1s, At(kDay, 10h + 12'345ms), Q::device},
      {"at once", 13s, At(kDay, 10h + 13s), 0s, At(kDay, 10h + 13s), Q::device},
      {"the minute before", 59'900ms, At(kDay, 10h + 5min + 300ms), 1s,
       At(kDay, 10h + 4min + 59'900ms), Q::device},
      {"the hour before", 59'999ms, At(kDay, 10h), 2s, At(kDay, 10h - 1ms), Q::device},
      {"the year before", 59'999ms, At(kNewYear, 1ms), 1s, At(kNewYear, -1ms), Q::device},
      {"its clock is ahead", 13'900ms, At(kDay, 10h + 12s), 1s, At(kDay, 10h + 13'900ms),
       Q::device},
      {"ahead over the minute", 500ms, At(kDay, 10h - 1s), 1s, At(kDay, 10h + 500ms), Q::device},
      {"its clock is behind", 9'100ms, At(kDay, 10h + 12s), 1s, At(kDay, 10h + 9'100ms), Q::device},
      {"too far ahead", 15s, At(kDay, 10h + 12s), 1s, At(kDay, 10h - 45s), Q::out_of_step},
      {"too far behind", 5s, At(kDay, 10h + 12s), 1s, At(kDay, 10h + 5s), Q::out_of_step},
      {"half a minute away", 42s, At(kDay, 10h + 12s), 1s, At(kDay, 10h - 18s), Q::out_of_step},
      {"asked after 50 s", 20s, At(kDay, 10h + 12s), 53s, At(kDay, 10h - 40s), Q::device},
      {"asked after a minute", 10s, At(kDay, 10h + 12s), 61s, At(kDay, 10h + 10s),
       Q::minute_guessed},
      {"asked after a minute, and but one fits", 40s, At(kDay, 10h + 12s), 61s, At(kDay, 10h - 20s),
       Q::device},
      {"after a start", 10s, At(kDay, 10h + 12s), std::nullopt, At(kDay, 10h + 10s),
       Q::minute_guessed},
      {"before 1970", 59s, WallTime(Duration(30s)), 40s, WallTime(Duration(-1s)), Q::device},
  };
  for (const Case& one : cases) {
    const PlacedTime placed = PlaceOne(one.said, one.received, one.oldest);
    EXPECT_EQ(FormatWallTime(placed.time), FormatWallTime(one.time)) << one.name;
    EXPECT_EQ(placed.time, one.time) << one.name;
    EXPECT_EQ(Name(placed.quality), Name(one.quality)) << one.name;
  }
}

/// The event happens between two reads, which are 1 s apart. The reply can take up to 2 s.
TEST(PlacedTime, IsRightForEveryDelayOfTwoSeconds) {
  for (const WallTime border : {At(kDay, 10h), At(kDay, 10h + 1min), At(kNewYear, 0s)}) {
    for (Duration before = -61s; before <= 61s; before += 97ms) {
      for (const Duration delay : {0ms, 1ms, 300ms, 999ms, 2'000ms}) {
        const WallTime happened = border + before;
        const Duration said = happened.time_since_epoch() % 1min;
        const PlacedTime placed = PlaceOne(said, happened + delay, delay + 1s);
        ASSERT_EQ(placed.time, happened) << before.count() << " " << delay.count();
        ASSERT_EQ(placed.quality, ClockQuality::device);
      }
    }
  }
}

TEST(PlacedTime, OfABatchKeepsItsOrder) {
  // The events contain only seconds. In the batch, 59.900 comes before 00.100, so it belongs to the
  // previous minute.
  const auto placed =
      Place({Seconds(59'900ms), Seconds(100ms), Seconds(100ms)}, At(kDay, 10h + 58s), {});
  EXPECT_EQ(placed[0].time, At(kDay, 10h - 100ms));
  EXPECT_EQ(placed[1].time, At(kDay, 10h + 100ms));
  EXPECT_EQ(placed[2].time, At(kDay, 10h + 100ms));
  // In the order 30, 20, 10 at least two minutes have passed.
  const auto long_ago = Place({Seconds(30s), Seconds(20s), Seconds(10s)}, At(kDay, 10h + 12s), {});
  EXPECT_EQ(long_ago[0].time, At(kDay, 10h - 90s));
  EXPECT_EQ(long_ago[1].time, At(kDay, 10h - 40s));
  EXPECT_EQ(long_ago[2].time, At(kDay, 10h + 10s));
  EXPECT_EQ(long_ago[0].quality, ClockQuality::minute_guessed);
  // A clock that was set back by a second must not make an event a minute older.
  const auto set_back = Place({Seconds(11s), Seconds(10s)}, At(kDay, 10h + 12s), 3s);
  EXPECT_EQ(set_back[0].time, At(kDay, 10h + 11s));
  EXPECT_EQ(set_back[1].time, At(kDay, 10h + 10s));
}

TEST(PlacedTime, WithoutADeviceTimeIsTheTimeOfReception) {
  const auto placed = Place({std::nullopt, Seconds(11s)}, At(kDay, 10h + 12s), 3s);
  EXPECT_EQ(placed[0].time, At(kDay, 10h + 12s));
  EXPECT_EQ(placed[0].quality, ClockQuality::none);
  EXPECT_EQ(placed[1].quality, ClockQuality::device);
}

TEST(PlacedTime, OfACompleteDateIsThatDate) {
  const WallTime date = At(kDay, 9h);
  const auto placed = Place({protocols::SaidTime{date.time_since_epoch(), {}}}, At(kDay, 10h), 1s);
  EXPECT_EQ(placed[0].time, date);
  EXPECT_EQ(placed[0].quality, ClockQuality::device);
}

using ::testing::HasSubstr;
using ::testing::IsEmpty;

EventRecord Port(const std::string& line, const std::string& text) {
  EventRecord record;
  record.line = line;
  record.code = CodeOf(OwnCode::port_down);
  record.text = text;
  return record;
}

class SharesTest : public ::testing::Test {
 protected:
  bool Take(const std::string& line, const std::string& text = "", bool room = true) {
    return shares_.Take(Port(line, text), room, now_.instant);
  }
  void Pass(Duration time) {
    now_.instant += time;
    now_.wall += time;
  }
  int Taken(const std::string& line, int events) {
    int taken = 0;
    for (int i = 0; i < events; ++i) taken += Take(line, std::to_string(i)) ? 1 : 0;
    return taken;
  }
  void Keep(const std::string& line, int events) {
    for (int i = 0; i < events; ++i) shares_.OnKept(Port(line, ""));
  }

  Now now_{Instant() + 1h, WallTime() + 1h};
  Shares shares_;
};

TEST_F(SharesTest, ASourceCannotUseTheShareOfAnother) {
  EXPECT_EQ(Taken("a", 1000), Shares::kAtOnce);
  EXPECT_EQ(Taken("b", 5), 5);
  EXPECT_EQ(shares_.left_out(), 1000U - Shares::kAtOnce);
}

TEST_F(SharesTest, TheNumberOfOmittedEventsAndTheLastOneAreReported) {
  Taken("a", 40);
  Keep("a", Shares::kAtOnce);
  EXPECT_THAT(shares_.TakeLeftOut(now_), IsEmpty());
  ASSERT_EQ(shares_.NextAt(), now_.instant + Shares::kSettles);
  Pass(Shares::kSettles);
  const auto told = shares_.TakeLeftOut(now_);
  ASSERT_EQ(told.size(), 2U);
  EXPECT_EQ(told[0].code, CodeOf(OwnCode::left_out));
  EXPECT_EQ(told[0].line, "a");
  EXPECT_THAT(told[0].text, HasSubstr("19 events"));
  EXPECT_EQ(told[1].code, CodeOf(OwnCode::port_down));
  EXPECT_EQ(told[1].text, "39");
  EXPECT_EQ(shares_.NextAt(), std::nullopt);
  EXPECT_FALSE(Take("a"));
  EXPECT_EQ(shares_.NextAt(), now_.instant + 2 * Shares::kSettles);
  Pass(2 * Shares::kSettles);
  EXPECT_EQ(shares_.TakeLeftOut(now_).size(), 1U) << "one alone is told as it is";
}

TEST_F(SharesTest, ALongFlappingIsReportedAtMostOnceAMinute) {
  Taken("a", Shares::kAtOnce);
  Keep("a", Shares::kAtOnce);
  std::size_t told = 0;
  for (Duration passed{}; passed < 1h; passed += 2500ms) {
    if (Take("a")) {
      ++told;
      Keep("a", 1);
    }
    Pass(2500ms);
    for (const EventRecord& one : shares_.TakeLeftOut(now_)) {
      told += one.code == CodeOf(OwnCode::port_down) ? 1 : 0;
      Keep("a", 1);
    }
  }
  EXPECT_LE(told, 65U);
}

TEST_F(SharesTest, TheRecordOfOmittedEventsRaisesNoAlarm) {
  EventRecord flaps = Port("a", "on");
  flaps.subject = "a above 5";
  flaps.record = "trip";
  flaps.mark = {.step = AlarmMark::Step::raise, .priority = config::AlarmPriority::high};
  for (int i = 0; i < 40; ++i) shares_.Take(flaps, true, now_.instant);
  Pass(Shares::kEach);
  const auto told = shares_.TakeLeftOut(now_);
  ASSERT_EQ(told.size(), 2U);
  EXPECT_EQ(told[0].mark.step, AlarmMark::Step::none);
  EXPECT_EQ(told[0].record, "");
  EXPECT_EQ(told[1].mark.step, AlarmMark::Step::raise);
}

TEST_F(SharesTest, AllOmittedEventsAreReportedAtTheEnd) {
  Taken("a", 40);
  EXPECT_THAT(shares_.TakeLeftOut(now_), IsEmpty());
  const auto told = shares_.TakeLeftOut(now_, true);
  ASSERT_EQ(told.size(), 2U);
  EXPECT_EQ(told[1].text, "39");
}

TEST_F(SharesTest, AShareRefillsWithTime) {
  EXPECT_EQ(Taken("a", Shares::kAtOnce), Shares::kAtOnce);
  Keep("a", Shares::kAtOnce);
  Pass(Shares::kAtOnce * Shares::kEach);
  EXPECT_EQ(Taken("a", 100), Shares::kAtOnce);
}

TEST_F(SharesTest, WaitingEventsAreBounded) {
  int taken = 0;
  for (int minute = 0; minute < 10'000; ++minute, Pass(Shares::kEach)) taken += Take("a") ? 1 : 0;
  EXPECT_EQ(taken, Shares::kAtOnce);
  EXPECT_FALSE(Take("b", "last", false)) << "no room for anybody";
  Keep("a", Shares::kAtOnce);
  const auto told = shares_.TakeLeftOut(now_);
  ASSERT_EQ(told.size(), 3U);
  EXPECT_EQ(told[2].text, "last");
}

}  // namespace
}  // namespace baudgate::events
