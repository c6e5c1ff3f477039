// What meters have kept themselves, in events.db: written with what its source has said, in one
// transaction, read back page by page, and the same behind hundreds of power cuts.
// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>
#include <sqlite3.h>

#include <random>

#include "gateway/records/events/event_file.h"
#include "gateway/records/events/record_table.h"
#include "tests/gateway/records/audit/faulty_disk.h"
#include "tests/support/long_run.h"

namespace baudgate::events {
namespace {

using audit::FaultyDisk;

const SourceNames kMeters = {{"bay", "meter-1"}, {"bay", "meter-2"}};
constexpr Duration kSpan = 30min;

PastRecord RecordAt(std::int64_t n) {
  PastRecord record{"load_1", n * kSpan, kSpan, {}};
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

  /// Nothing: the file does not open.
  std::optional<std::string> Said(Source source) {
    const auto opened = file_.Open();
    if (opened && !opened->ok) return std::nullopt;
    if (opened) book_.OnOpened(opened->contents.last, opened->contents.said);
    return book_.said(kMeters[source]);
  }
  bool Keep(Source source, const std::string& said, std::vector<PastRecord> records) {
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
  Database database(audit::kEventsFile, Database::Mode::read, disk.vfs());
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

TEST(Past, IsReadBackByItsTimes) {
  FaultyDisk disk;
  Gateway gateway(disk);
  ASSERT_TRUE(gateway.Said(0));
  std::vector<PastRecord> records;
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
  Database database(audit::kEventsFile, Database::Mode::read, disk.vfs());
  EXPECT_FALSE(ReadPast(database, QueryOf("meter-1", "load_2.active_import"))->known);
  EXPECT_FALSE(ReadPast(database, QueryOf("meter-3"))->known);
}

TEST(Past, AnHourThatCameTwiceIsThereTwice) {
  FaultyDisk disk;
  Gateway gateway(disk);
  ASSERT_TRUE(gateway.Said(0));
  ASSERT_TRUE(gateway.Keep(0, "1", {RecordAt(5), RecordAt(6), RecordAt(5), RecordAt(6)}));
  EXPECT_EQ(ReadAll(disk, QueryOf()).size(), 4U);
}

TEST(Past, AGapIsInAllValuesOfTheSeries) {
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

TEST(Past, TheOldestGiveWay) {
  FaultyDisk disk;
  Gateway gateway(disk);
  ASSERT_TRUE(gateway.Said(0));
  Database database(audit::kEventsFile, Database::Mode::write, disk.vfs());
  PastTable table(database, 100);
  for (std::int64_t n = 0; n < 80; ++n) ASSERT_TRUE(table.Insert("bay", "meter-1", {RecordAt(n)}));
  const auto rows = ReadAll(disk, QueryOf());
  EXPECT_EQ(rows.size(), 50U);
  EXPECT_EQ(rows.back().value, Value(79.0));
}

/// What is in the file and what its source has said belong together, whenever the power fails: so
/// nothing is read twice from the meter, and nothing left out.
TEST(Past, APowerCutTakesARecordAndThePlaceBehindItTogether) {
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
          std::vector<PastRecord> records;
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

}  // namespace
}  // namespace baudgate::events
