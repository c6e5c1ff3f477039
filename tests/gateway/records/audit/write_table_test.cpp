// The file: what is written is read back, restarts, room, and files that are none.
// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>
#include <sqlite3.h>

#include <fstream>
#include <limits>
#include <map>

#include "gateway/records/audit/audit_file.h"
#include "tests/gateway/records/audit/faulty_disk.h"
#include "tests/gateway/records/audit/fixture.h"

namespace baudgate::audit {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::Pair;
namespace fs = std::filesystem;

class WriteTableTest : public FolderTest {
 protected:
  void Add(AuditBook& book, WriteRecord record, std::optional<WriteEnd> end = WriteEnd::ok) {
    const auto ticket = book.Begin(std::move(record));
    if (end) book.End(*ticket, {*end, "because", 12345us});
  }
  AuditFile::Opened Open() {
    auto opened = AuditFile(file()).Open();
    return opened.value_or(AuditFile::Opened{});
  }
};

TEST_F(WriteTableTest, GivesBackWhatWasWritten) {
  AuditFile audit(file());
  AuditBook book;
  WriteRecord record = WrittenPoint("192.0.2.5:40312", 1);
  record.before = 30.25;
  record.value = std::string("text ' \"");
  Add(book, record, WriteEnd::differs);
  WriteRecord flag = WrittenPoint("user:root");
  flag.value = true;
  flag.before = Value();
  Add(book, flag, std::nullopt);
  ASSERT_TRUE(Keep(audit, book));
  const auto rows = ReadAll(file());
  ASSERT_EQ(rows.size(), 2U);
  EXPECT_EQ(rows[0].seq, 1);
  EXPECT_EQ(rows[0].kind, Kind::point);
  EXPECT_EQ(rows[0].time, kWall);
  EXPECT_EQ(rows[0].client, "192.0.2.5:40312");
  EXPECT_EQ(rows[0].line + "." + rows[0].device + "." + rows[0].point, "bay-1.feeder-1.group");
  EXPECT_EQ(rows[0].before, Value(30.25));
  EXPECT_EQ(rows[0].value, Value(std::string("text ' \"")));
  EXPECT_EQ(rows[0].end, WriteEnd::differs);
  EXPECT_EQ(rows[0].reason, "because");
  EXPECT_EQ(rows[0].took, 12345us);
  EXPECT_EQ(rows[0].settled, 1);
  EXPECT_EQ(rows[1].end, std::nullopt);
  EXPECT_EQ(OutcomeOf(rows[1]), "pending");
  EXPECT_EQ(rows[1].settled, std::nullopt);
  EXPECT_EQ(rows[1].value, Value(std::int64_t{1}));
  EXPECT_FALSE(HasValue(rows[1].before));
}

TEST_F(WriteTableTest, RequestsOfAnEarlierRunAreReadTheLatestFirst) {
  constexpr std::uint64_t kHighest = std::numeric_limits<std::uint64_t>::max();
  {
    AuditFile audit(file());
    AuditBook book;
    Add(book, WrittenPoint("user:root"));
    WriteRecord record = WrittenPoint("dds:a");
    record.request = {"hmi-1", 7, "feeder-1 group 3"};
    Add(book, record);
    record.request = {"hmi-2", kHighest, "feeder-1 group 4"};
    Add(book, record, std::nullopt);
    WriteRecord denied = record;
    denied.kind = Kind::denied;
    Add(book, denied, WriteEnd::denied);
    ASSERT_TRUE(Keep(audit, book));
    EXPECT_EQ(ReadAll(file())[1].request, (RequestId{"hmi-1", 7, "feeder-1 group 3"}));
  }
  AuditFile again(file());
  ASSERT_TRUE(again.Open()->ok);
  Database database(file().string(), Database::Mode::read);
  const auto past = ReadRequests(database, kWall + 3s);
  ASSERT_TRUE(past) << past.error();
  ASSERT_EQ(past->size(), 2U) << "what was denied was never done";
  EXPECT_EQ((*past)[0].id, (RequestId{"hmi-2", kHighest, "feeder-1 group 4"}));
  EXPECT_EQ((*past)[0].end, WriteEnd::unknown) << "the gateway was stopped before it had ended";
  EXPECT_EQ((*past)[1].id.seq, 7U);
  EXPECT_EQ((*past)[1].end, WriteEnd::ok);
  EXPECT_EQ((*past)[1].took, 12345us);
  EXPECT_EQ((*past)[1].age, 3s);
}

TEST_F(WriteTableTest, IsDurableAndSaysWhatItIs) {
  ASSERT_TRUE(Open().ok);
  Database database(file().string(), Database::Mode::write);
  EXPECT_EQ(ToText(database.First("PRAGMA journal_mode")), "wal");
  EXPECT_EQ(database.First("PRAGMA application_id"), Value(kEventsApplication));
  EXPECT_EQ(database.First("PRAGMA user_version"), Value(kEventsVersion));
  AuditFile again(file());
  EXPECT_TRUE(again.Open()->ok);
}

TEST_F(WriteTableTest, WhatHadNotEndedIsUnknownAfterARestart) {
  {
    AuditFile audit(file());
    AuditBook book;
    Add(book, WrittenPoint("a"), std::nullopt);
    Add(book, WrittenPoint("b"), WriteEnd::ok);
    WriteRecord route = RouteWrite("c", 3);
    route.count = 7;
    book.Begin(route);
    ASSERT_TRUE(Keep(audit, book));
  }
  AuditFile again(file());
  ASSERT_TRUE(again.Open()->ok);
  EXPECT_THAT(again.unsettled(),
              ElementsAre(Target{WrittenPoint("a").line, WrittenPoint("a").device}));
  const auto rows = ReadAll(file());
  ASSERT_EQ(rows.size(), 3U);
  EXPECT_EQ(rows[0].end, WriteEnd::unknown);
  EXPECT_THAT(rows[0].reason, HasSubstr("stopped before it had ended"));
  EXPECT_EQ(rows[1].end, WriteEnd::ok);
  EXPECT_EQ(rows[1].reason, "because");
  EXPECT_EQ(rows[2].end, WriteEnd::ok) << "of repeats the outcome is known";
  EXPECT_EQ(rows[2].count, 7U);
  Database database(file().string(), Database::Mode::write);
  EXPECT_EQ(ReadAll(database, PageQuery::Order::settled).size(), 3U);
}

TEST_F(WriteTableTest, NumbersGoOnOverRestartsThoughAllRowsAreGone) {
  {
    AuditFile audit(file());
    AuditBook book;
    Add(book, WrittenPoint("a"));
    ASSERT_TRUE(Keep(audit, book));
  }
  Database database(file().string(), Database::Mode::write);
  ASSERT_TRUE(database.Execute("DELETE FROM writes"));
  AuditFile audit(file());
  AuditBook book;
  Add(book, WrittenPoint("b"));
  ASSERT_TRUE(Keep(audit, book));
  EXPECT_EQ(ReadAll(database).at(0).seq, 2);
}

TEST_F(WriteTableTest, TheOldestOfWhoWritesMostGoesFirst) {
  constexpr std::array<Room, kKinds> kSmall = {Room{10, kDay}, Room{5, kDay}, Room{5, kDay},
                                               Room{5, kDay}};
  AuditFile audit(file(), {}, kSmall);
  AuditBook book;
  Add(book, WrittenPoint("operator", 1, "trip"));
  for (int i = 0; i < 40; ++i) Add(book, WrittenPoint("plc", i, "set_point"));
  for (int i = 0; i < 40; ++i) Add(book, RouteWrite("plc", i));
  ASSERT_TRUE(Keep(audit, book));
  audit.Tidy({kStart, kWall});
  const auto rows = ReadAll(file());
  ASSERT_EQ(rows.size(), 15U);
  EXPECT_EQ(rows[0].point, "trip");
  EXPECT_EQ(ToText(rows[1].value), "31");
  EXPECT_EQ(ToText(rows[9].value), "39");
  EXPECT_EQ(rows[10].kind, Kind::route);
}

/// Points that are written evenly lose evenly, and none loses what another has to give.
TEST_F(WriteTableTest, RoomIsMadeByAllWhoHaveMost) {
  constexpr std::array<Room, kKinds> kSmall = {Room{20, kDay}, Room{5, kDay}, Room{5, kDay},
                                               Room{5, kDay}};
  AuditFile audit(file(), {}, kSmall);
  AuditBook book;
  for (int i = 0; i < 9; ++i) {
    for (const char* point : {"p0", "p1", "p2"}) Add(book, WrittenPoint("plc", i, point));
  }
  for (int i = 0; i < 3; ++i) Add(book, WrittenPoint("plc", i, "p3"));
  for (int i = 0; i < 8; ++i) Add(book, WrittenPoint("plc", i, "p4"), std::nullopt);
  ASSERT_TRUE(Keep(audit, book));
  audit.Tidy({kStart, kWall});
  std::map<std::string, std::string> left;
  for (const WriteRecord& row : ReadAll(file())) left[row.point] += ToText(row.value);
  EXPECT_THAT(left, ElementsAre(Pair("p0", "678"), Pair("p1", "678"), Pair("p2", "678"),
                                Pair("p3", "012"), Pair("p4", "01234567")))
      << "p4 has not ended yet";
}

TEST_F(WriteTableTest, OldOnesGoOnceADay) {
  AuditFile audit(file());
  AuditBook book;
  Add(book, WrittenPoint("old"));
  ASSERT_TRUE(Keep(audit, book));
  const WallTime years_later = kWall + 6 * 366 * kDay;
  audit.Tidy({kStart, years_later});
  EXPECT_EQ(ReadAll(file()).size(), 1U) << "the clock may be wrong at the start";
  audit.Tidy({kStart + 25h, years_later});
  EXPECT_EQ(ReadAll(file()).size(), 0U);
}

TEST_F(WriteTableTest, ADamagedFileIsPutAsideAndNamed) {
  for (const std::size_t size : {std::size_t{600}, std::size_t{20'000}}) {
    const std::string content(size, 'x');
    std::ofstream(file()) << content;
    const auto opened = Open();
    EXPECT_TRUE(opened.ok) << opened.error;
    EXPECT_THAT(opened.put_aside, HasSubstr("events.db.bad"));
    fs::remove(file());
  }
  EXPECT_TRUE(fs::exists(file().string() + ".bad"));
  EXPECT_TRUE(fs::exists(file().string() + ".bad2")) << "none is written over";
}

TEST_F(WriteTableTest, PagesOverwrittenWithGarbageAreFound) {
  {
    AuditFile audit(file());
    AuditBook book;
    for (int i = 0; i < 500; ++i) Add(book, WrittenPoint("a", i));
    ASSERT_TRUE(Keep(audit, book));
  }
  {
    std::fstream damage(file(), std::ios::in | std::ios::out | std::ios::binary);
    damage.seekp(4096 + 8);
    for (int i = 0; i < 12'000; ++i) damage.put(static_cast<char>(i * 7));
  }
  const auto opened = Open();
  EXPECT_TRUE(opened.ok) << opened.error;
  EXPECT_THAT(opened.put_aside, HasSubstr("is damaged"));
}

TEST_F(WriteTableTest, StrangeRowsAreReadAsWhatTheyCanBe) {
  ASSERT_TRUE(Open().ok);
  Database database(file().string(), Database::Mode::write);
  ASSERT_TRUE(database.Execute(
      "INSERT INTO writes VALUES (1,'odd',-9223372036854775808,9223372036854775807,x'00FF',1,2,3,"
      "x'01','text',9e999,'OK','',-5,-7,'x',x'00','-1',7)"));
  const auto rows = ReadAll(database);
  ASSERT_EQ(rows.size(), 1U);
  EXPECT_EQ(rows[0].end, WriteEnd::unknown) << "what is not known is no success";
  EXPECT_EQ(FormatWallTime(rows[0].time), "1970-01-01T00:00:00.000Z");
  EXPECT_EQ(FormatWallTime(rows[0].last), "2200-01-01T00:00:00.000Z");
  EXPECT_EQ(rows[0].count, 1U);
  EXPECT_EQ(rows[0].took, Duration::zero());
  EXPECT_FALSE(HasValue(rows[0].before));
}

TEST_F(WriteTableTest, ANewerFileIsLeftAlone) {
  ASSERT_TRUE(Open().ok);
  Database database(file().string(), Database::Mode::write);
  ASSERT_TRUE(database.Execute("PRAGMA user_version=99"));
  const auto opened = Open();
  EXPECT_FALSE(opened.ok);
  EXPECT_THAT(opened.error, HasSubstr("a newer baudgate has made it"));
  EXPECT_TRUE(opened.put_aside.empty());
}

TEST(WriteTableFaults, AFullDiskKeepsNothingAndDoublesNothing) {
  FaultyDisk disk;
  AuditFile audit("/events.db", disk.vfs());
  AuditBook book;
  book.Begin(WrittenPoint("a"));
  ASSERT_TRUE(Keep(audit, book));
  const Ticket ticket = *book.Begin(WrittenPoint("b"));
  for (const int error : {SQLITE_FULL, SQLITE_IOERR_WRITE, SQLITE_READONLY}) {
    disk.write_error = error;
    const Status status = Keep(audit, book);
    ASSERT_FALSE(status);
    EXPECT_THAT(status.error(), HasSubstr("/events.db: "));
    EXPECT_LT(book.newest_written(), ticket);
  }
  disk.write_error = 0;
  disk.sync_error = SQLITE_IOERR_FSYNC;
  ASSERT_FALSE(Keep(audit, book)) << "the bytes went out, but nobody knows whether they stay";
  disk.sync_error = 0;
  ASSERT_TRUE(Keep(audit, book));
  const auto rows = ReadAll("/events.db", disk.vfs());
  ASSERT_EQ(rows.size(), 2U);
  EXPECT_EQ(rows[1].seq, 2);
}

TEST(WriteTableFaults, ADiskThatCanNotBeOpenedIsTriedAgain) {
  FaultyDisk disk;
  disk.open_error = SQLITE_CANTOPEN;
  AuditFile audit("/events.db", disk.vfs());
  AuditBook book;
  book.Begin(WrittenPoint("a"));
  EXPECT_FALSE(Keep(audit, book));
  disk.open_error = 0;
  EXPECT_TRUE(Keep(audit, book));
  EXPECT_EQ(ReadAll("/events.db", disk.vfs()).size(), 1U);
}

}  // namespace
}  // namespace baudgate::audit
