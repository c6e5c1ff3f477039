// Files as the first version of the tables had them are read and written on.
// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include "gateway/history/history_page.h"
#include "gateway/history/value_store.h"
#include "gateway/state/versions.h"
#include "tests/gateway/history/store_fixture.h"

namespace baudgate::history {
namespace {

constexpr const char* kValues =
    "CREATE TABLE points (point INTEGER PRIMARY KEY, name TEXT NOT NULL UNIQUE, type TEXT NOT "
    "NULL);"
    "CREATE TABLE runs (run INTEGER PRIMARY KEY, began INTEGER NOT NULL, until INTEGER NOT NULL, "
    "why TEXT NOT NULL);"
    "CREATE TABLE rows_a (point INTEGER, run INTEGER, time INTEGER, value, quality INTEGER);"
    "CREATE TABLE rows_b (point INTEGER, run INTEGER, time INTEGER, value, quality INTEGER);"
    "CREATE VIEW rows AS SELECT * FROM rows_a UNION ALL SELECT * FROM rows_b;"
    "CREATE TABLE chunks (point INTEGER NOT NULL, run INTEGER NOT NULL, first INTEGER NOT NULL, "
    "last INTEGER NOT NULL, count INTEGER NOT NULL, bytes BLOB NOT NULL);"
    "CREATE INDEX chunks_point ON chunks (point, run, first);"
    "INSERT INTO points VALUES (1, 'bay.f1.a', 'float32');"
    "PRAGMA journal_mode=WAL; PRAGMA application_id=1111979617; PRAGMA user_version=1;";
constexpr const char* kTrends =
    "CREATE TABLE points (point INTEGER PRIMARY KEY, name TEXT NOT NULL UNIQUE);"
    "CREATE TABLE runs (run INTEGER PRIMARY KEY, began INTEGER NOT NULL, until INTEGER NOT NULL, "
    "why TEXT NOT NULL);"
    "CREATE TABLE minutes (point INTEGER NOT NULL, begin INTEGER NOT NULL, run INTEGER NOT NULL, "
    "mean REAL NOT NULL, min REAL NOT NULL, max REAL NOT NULL, first REAL NOT NULL, last REAL NOT "
    "NULL, count INTEGER NOT NULL, good INTEGER NOT NULL, PRIMARY KEY (point, begin, run)) WITHOUT "
    "ROWID;"
    "CREATE TABLE hours (point INTEGER NOT NULL, begin INTEGER NOT NULL, run INTEGER NOT NULL, "
    "mean REAL NOT NULL, min REAL NOT NULL, max REAL NOT NULL, first REAL NOT NULL, last REAL NOT "
    "NULL, count INTEGER NOT NULL, good INTEGER NOT NULL, PRIMARY KEY (point, begin, run)) WITHOUT "
    "ROWID;"
    "PRAGMA journal_mode=WAL; PRAGMA application_id=1111979122; PRAGMA user_version=1;";

class OldFiles : public FolderTest {
 protected:
  void Make(const std::string& name, const std::string& sql) const {
    Database database((folder() / name).string(), Database::Mode::write);
    ASSERT_TRUE(database.Execute(sql)) << database.error();
  }
  std::string First(const std::string& name, const char* sql) const {
    Database database((folder() / name).string(), Database::Mode::read);
    return ToText(database.First(sql));
  }
};

TEST_F(OldFiles, AreReadAndWrittenOn) {
  const std::string day = DayFileName(kBegin);
  const std::string begin = std::to_string(kBegin);
  Make(day, kValues + ("INSERT INTO runs VALUES (1, " + begin + ", " + begin + ", 'started');" +
                       "INSERT INTO rows_a VALUES (1, 1, " + begin + ", 7.5, 192);"));
  Make("trends.db", kTrends);
  EXPECT_EQ(NewerStateIn(folder()), "");
  {
    ValueStore store(folder(), {{"bay.f1.a", config::Type::float32}}, {});
    const Status opened = store.Open(At(kBegin + kSecond));
    ASSERT_TRUE(opened) << opened.error();
    Batch batch;
    batch.runs = {{2, kBegin + kSecond, kBegin + 2 * kSecond, RunBegin::started}};
    batch.samples = {{0, 2, {kBegin + kSecond, 8.5, Quality::good}}};
    const Status written = store.Write(std::move(batch), At(kBegin + 2 * kSecond), true);
    EXPECT_TRUE(written) << written.error();
    EXPECT_TRUE(store.TakeNews().empty()) << "nothing was put aside";
  }
  PageQuery query;
  query.point = "bay.f1.a";
  const auto page = ReadPage(folder(), query);
  ASSERT_TRUE(page) << page.error();
  ASSERT_GE(page->records.size(), 2U);
}

/// What gateway/state knows of the files of this room.
TEST_F(OldFiles, TheirVersionIsKnownWhereNewerOnesAreRefused) {
  ValueStore store(folder(), {{"bay.f1.a", config::Type::float32}}, {});
  ASSERT_TRUE(store.Open(At(kBegin)));
  Batch batch;
  batch.runs = {{1, kBegin, kBegin + kSecond, RunBegin::started}};
  batch.samples = {{0, 1, {kBegin, 8.5, Quality::good}}};
  ASSERT_TRUE(store.Write(std::move(batch), At(kBegin + kSecond), true));
  EXPECT_EQ(First(DayFileName(kBegin), "PRAGMA user_version"),
            std::to_string(KnownVersion(kValuesApplication)));
  EXPECT_EQ(First("trends.db", "PRAGMA user_version"),
            std::to_string(KnownVersion(kTrendsApplication)));
}

}  // namespace
}  // namespace baudgate::history
