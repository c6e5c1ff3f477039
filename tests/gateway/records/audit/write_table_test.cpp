// Tests of the file of the audit, and of repeated and routed writes.
// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sqlite3.h>

#include <algorithm>
#include <fstream>
#include <limits>
#include <map>

#include "gateway/records/audit/audit_file.h"
#include "gateway/records/audit/audit_log.h"
#include "gateway/records/audit/audited_writes.h"
#include "tests/gateway/records/audit/faulty_disk.h"
#include "tests/gateway/records/audit/fixture.h"
#include "tests/gateway/records/audit/remembering_log.h"

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

TEST_F(WriteTableTest, StoredRecordsAreReadBack) {
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
    EXPECT_EQ(ReadAll(file())[1].request, (bus::RequestId{"hmi-1", 7, "feeder-1 group 3"}));
  }
  AuditFile again(file());
  ASSERT_TRUE(again.Open()->ok);
  records::Database database(file().string(), records::Database::Mode::read);
  const auto past = ReadRequests(database, kWall + 3s);
  ASSERT_TRUE(past) << past.error();
  ASSERT_EQ(past->size(), 2U) << "what was denied was never done";
  EXPECT_EQ((*past)[0].id, (bus::RequestId{"hmi-2", kHighest, "feeder-1 group 4"}));
  EXPECT_EQ((*past)[0].end, WriteEnd::unknown) << "the gateway was stopped before it had ended";
  EXPECT_EQ((*past)[1].id.seq, 7U);
  EXPECT_EQ((*past)[1].end, WriteEnd::ok);
  EXPECT_EQ((*past)[1].took, 12345us);
  EXPECT_EQ((*past)[1].age, 3s);
}

TEST_F(WriteTableTest, TheFileHasDurableSettingsAndItsVersion) {
  ASSERT_TRUE(Open().ok);
  records::Database database(file().string(), records::Database::Mode::write);
  EXPECT_EQ(ToText(database.First("PRAGMA journal_mode")), "wal");
  EXPECT_EQ(database.First("PRAGMA application_id"), Value(records::kEventsApplication));
  EXPECT_EQ(database.First("PRAGMA user_version"), Value(records::kEventsVersion));
  AuditFile again(file());
  EXPECT_TRUE(again.Open()->ok);
}

TEST_F(WriteTableTest, APendingWriteIsUnknownAfterARestart) {
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
  records::Database database(file().string(), records::Database::Mode::write);
  EXPECT_EQ(ReadAll(database, PageQuery::Order::settled).size(), 3U);
}

TEST_F(WriteTableTest, NumbersContinueAfterARestartWithoutRows) {
  {
    AuditFile audit(file());
    AuditBook book;
    Add(book, WrittenPoint("a"));
    ASSERT_TRUE(Keep(audit, book));
  }
  records::Database database(file().string(), records::Database::Mode::write);
  ASSERT_TRUE(database.Execute("DELETE FROM writes"));
  AuditFile audit(file());
  AuditBook book;
  Add(book, WrittenPoint("b"));
  ASSERT_TRUE(Keep(audit, book));
  EXPECT_EQ(ReadAll(database).at(0).seq, 2);
}

TEST_F(WriteTableTest, TheOldestRecordOfTheBusiestWriterIsDeletedFirst) {
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

TEST_F(WriteTableTest, AllWritersWithMostRecordsLoseTheirOldest) {
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

TEST_F(WriteTableTest, OldRecordsAreDeletedOnceADay) {
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

TEST_F(WriteTableTest, StrangeRowsAreReadWithDefaults) {
  ASSERT_TRUE(Open().ok);
  records::Database database(file().string(), records::Database::Mode::write);
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

TEST_F(WriteTableTest, AFileOfANewerVersionIsLeftUnchanged) {
  ASSERT_TRUE(Open().ok);
  records::Database database(file().string(), records::Database::Mode::write);
  ASSERT_TRUE(database.Execute("PRAGMA user_version=99"));
  const auto opened = Open();
  EXPECT_FALSE(opened.ok);
  EXPECT_THAT(opened.error, HasSubstr("a newer baudgate has written the file"));
  EXPECT_TRUE(opened.put_aside.empty());
}

TEST(WriteTableFaults, AFullDiskStoresNothingAndDuplicatesNothing) {
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

TEST(WriteTableFaults, AnUnopenableDiskIsRetried) {
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

class RepeatsTest : public ::testing::Test {
 protected:
  const std::vector<WriteRecord>& Rows() {
    std::vector<Draft> drafts = book_.Due();
    for (Draft& draft : drafts) {
      WriteRecord& record = draft.record;
      if (record.seq == 0) {
        record.seq = static_cast<std::int64_t>(rows_.size()) + 1;
        rows_.emplace_back();
      }
      rows_[static_cast<std::size_t>(record.seq) - 1] = record;
    }
    book_.OnWritten(drafts);
    return rows_;
  }
  void Add(WriteRecord record) {
    record.last = kWall + (now_ - kStart);
    repeats_.Add(std::move(record), now_);
  }

  AuditBook book_;
  Repeats repeats_{book_};
  Instant now_ = kStart;
  std::vector<WriteRecord> rows_;
};

TEST_F(RepeatsTest, ASetPointEvery30MsGivesOneRowAMinute) {
  for (std::int64_t i = 0; i < 4000; ++i, now_ += 30ms) {
    Add(RouteWrite("192.0.2.5:40312", i));
    if (i % 33 == 0) repeats_.Tick(now_);
  }
  repeats_.Close();
  const auto& rows = Rows();
  ASSERT_GE(rows.size(), 2U);
  ASSERT_LE(rows.size(), 3U);
  std::uint64_t count = 0;
  for (const WriteRecord& row : rows) count += row.count;
  EXPECT_EQ(count, 4000U);
  EXPECT_EQ(ToText(rows[0].first), "0");
  EXPECT_EQ(std::get<std::int64_t>(rows[0].value), static_cast<std::int64_t>(rows[0].count) - 1);
  EXPECT_GT(rows[0].last, rows[0].time + 59s);
  EXPECT_EQ(ToText(rows.back().value), "3999");
}

TEST_F(RepeatsTest, TheFirstWriteIsStoredAtOnceAndASingleWriteIsNoRepeat) {
  Add(RouteWrite("a", 5));
  ASSERT_EQ(Rows().size(), 1U);
  EXPECT_FALSE(HasValue(Rows()[0].first));
  EXPECT_EQ(Rows()[0].count, 1U);
}

TEST_F(RepeatsTest, ADifferentOutcomeRegisterOrClientHasItsOwnRow) {
  Add(RouteWrite("192.0.2.5:1", 5));
  Add(RouteWrite("192.0.2.5:2", 5));
  WriteRecord refused = RouteWrite("192.0.2.5:1", 5);
  refused.end = WriteEnd::refused;
  Add(refused);
  WriteRecord other = RouteWrite("192.0.2.5:1", 5);
  other.point = "06 holding 101";
  Add(other);
  Add(RouteWrite("192.0.2.6:1", 5));
  repeats_.Tick(now_ + 1s);
  ASSERT_EQ(Rows().size(), 4U);
  EXPECT_EQ(Rows()[0].count, 2U);
}

TEST_F(RepeatsTest, ManyAddressesShareOneRecord) {
  constexpr int kWrites = 10'000;
  for (int i = 0; i < kWrites; ++i) {
    WriteRecord denied =
        WrittenPoint("10.0." + std::to_string(i / 256) + "." + std::to_string(i % 256) + ":502");
    denied.kind = Kind::denied;
    denied.end = WriteEnd::denied;
    Add(denied);
  }
  repeats_.Close();
  const auto& rows = Rows();
  EXPECT_EQ(rows.size(), Repeats::kMost + 1);
  std::uint64_t count = 0;
  for (const WriteRecord& row : rows) count += row.count;
  EXPECT_EQ(count, static_cast<std::uint64_t>(kWrites)) << "all are counted";
  EXPECT_EQ(rows.back().client, Repeats::kManyClients);
  EXPECT_EQ(book_.unwritten(), 0U);
}

TEST_F(RepeatsTest, AFloodDoesNotHideOtherClients) {
  for (int i = 0; i < 5000; ++i) {
    WriteRecord record = RouteWrite("192.0.2.66:" + std::to_string(i), i);
    record.point = "06 holding " + std::to_string(i);
    Add(record);
    record.kind = Kind::denied;
    record.client = "10.1." + std::to_string(i / 256) + "." + std::to_string(i % 256) + ":1";
    Add(record);
  }
  Add(RouteWrite("192.0.2.5:40312", 7));
  repeats_.Tick(now_ + 1s);
  const auto& rows = Rows();
  EXPECT_EQ(rows.size(), Repeats::kMostOfClient + 1 + Repeats::kMost + 1 + 1);
  EXPECT_EQ(rows.back().client, "192.0.2.5:40312");
  EXPECT_EQ(rows.back().point, "06 holding 100");
  const auto shared = std::ranges::find(rows, Repeats::kManyPoints, &WriteRecord::point);
  ASSERT_NE(shared, rows.end());
  EXPECT_EQ(AddressOf(shared->client), "192.0.2.66");
  EXPECT_EQ(shared->count, 5000U - Repeats::kMostOfClient);
  repeats_.Tick(now_ + 2min);
  EXPECT_TRUE(repeats_.empty());
  Add(RouteWrite("192.0.2.66:1", 7));
  EXPECT_EQ(Rows().back().point, "06 holding 100") << "it has room again";
}

TEST_F(RepeatsTest, AddressesLoseTheirPort) {
  EXPECT_EQ(AddressOf("192.0.2.5:40312"), "192.0.2.5");
  EXPECT_EQ(AddressOf("[2001:db8::1]:502"), "[2001:db8::1]");
  EXPECT_EQ(AddressOf("user:root"), "user:root");
  EXPECT_EQ(AddressOf("/dev/ttyS1"), "/dev/ttyS1");
}

RoutedWrite Write(View pdu) { return {"10.0.0.7:1", "drive", 20, false, pdu, {kStart, kWall}}; }

std::string Said(const Bytes& pdu) {
  const WriteRecord record = RecordOf(Write(pdu));
  return record.point + " = " + ToText(record.value);
}

TEST(RoutedRecord, HasFunctionAddressAndValues) {
  EXPECT_EQ(Said({5, 0, 3, 0xFF, 0}), "05 coil 3 = 1");
  EXPECT_EQ(Said({5, 0, 3, 0, 0}), "05 coil 3 = 0");
  EXPECT_EQ(Said({6, 0, 100, 1, 2}), "06 holding 100 = 258");
  EXPECT_EQ(Said({16, 0, 100, 0, 2, 4, 0, 1, 0, 2}), "16 holding 100-101 = 1 2");
  EXPECT_EQ(Said({16, 0, 100, 0, 1, 2, 0, 9}), "16 holding 100 = 9");
  EXPECT_EQ(Said({15, 0, 8, 0, 3, 1, 0x05}), "15 coil 8-10 = 1 0 1");
  EXPECT_EQ(Said({22, 0, 4, 0, 0xF2, 0, 0x25}), "22 holding 4 = and 242 or 37");
  EXPECT_EQ(Said({23, 0, 3, 0, 6, 0, 14, 0, 1, 2, 0, 255}), "23 holding 14 = 255");
  EXPECT_EQ(Said({66, 1, 2, 3}), "66 = ");
  const WriteRecord record = RecordOf(Write(Bytes{6, 0, 1, 0, 0}));
  EXPECT_EQ(record.line + ", " + record.device, "drive, unit 20");
}

TEST(RoutedRecord, OfARequestWithOddLengthsHasItsFirstAddress) {
  EXPECT_EQ(Said({5, 0, 3, 0xFF, 0, 0}), "05 coil 3 = 6 bytes in an unusual form");
  EXPECT_EQ(Said({16, 0, 100, 0, 2, 4, 0, 1}), "16 holding 100 = 8 bytes in an unusual form");
  EXPECT_EQ(Said({23, 0, 3, 0, 6, 0, 14, 0, 200, 2, 0, 255}),
            "23 holding 14 = 12 bytes in an unusual form");
  EXPECT_EQ(Said({22, 0, 4, 0, 1}), "22 holding 4 = 5 bytes in an unusual form");
  EXPECT_EQ(Said({22, 0}), "22 = ");
  EXPECT_EQ(Said({6}), "06 = ");
}

TEST(RoutedRecord, ListsAtMostSixteenValues) {
  Bytes pdu = {16, 0, 0, 0, 100, 200};
  pdu.resize(206, 0);
  EXPECT_THAT(Said(pdu), HasSubstr("0 0 0 … (100)"));
}

class WitnessTest : public ::testing::Test {
 protected:
  const WriteRecord& After(const bus::RoutedReply& reply, bool broadcast = false) {
    const Bytes pdu = {6, 0, 1, 0, 2};
    RoutedWrite write = Write(pdu);
    write.broadcast = broadcast;
    Witness::Watch(std::make_shared<Witness>(log_, write), [](bus::RoutedReply) {})(reply);
    return log_.noted.back();
  }
  static bus::RoutedReply Reply(Outcome outcome, bool sent, Bytes pdu = {}) {
    bus::RoutedReply reply;
    reply.outcome = outcome;
    reply.sent = sent;
    reply.pdu = std::move(pdu);
    reply.reason = "silence";
    return reply;
  }
  RememberingLog log_;
};

TEST_F(WitnessTest, RecordsTheKnownOutcome) {
  EXPECT_EQ(After(Reply(Outcome::ok, true, {6, 0, 1, 0, 2})).end, WriteEnd::ok);
  EXPECT_EQ(After(Reply(Outcome::refused, true, {0x86, 2})).end, WriteEnd::refused);
  EXPECT_THAT(log_.noted.back().reason, HasSubstr("exception 02"));
  EXPECT_EQ(After(Reply(Outcome::no_reply, true)).end, WriteEnd::unknown);
  EXPECT_EQ(log_.noted.back().reason, "silence");
  EXPECT_EQ(After(Reply(Outcome::no_reply, false)).end, WriteEnd::not_sent);
  EXPECT_EQ(After(Reply(Outcome::ok, true), true).end, WriteEnd::unknown)
      << "nobody answers a broadcast";
}

TEST_F(WitnessTest, ADroppedRequestIsNotRecordedAsSuccess) {
  const Bytes pdu = {6, 0, 1, 0, 2};
  { const auto done = Witness::Watch(std::make_shared<Witness>(log_, Write(pdu)), {}); }
  ASSERT_EQ(log_.noted.size(), 1U);
  EXPECT_EQ(log_.noted[0].end, WriteEnd::unknown);
}

TEST_F(WitnessTest, ADeniedRequestIsOneRecord) {
  const Bytes pdu = {6, 0, 1, 0, 2};
  {
    const auto witness = std::make_shared<Witness>(log_, Write(pdu));
    const auto done = Witness::Watch(witness, {});
    witness->Deny(WriteEnd::busy, "full");
  }
  ASSERT_EQ(log_.noted.size(), 1U);
  EXPECT_EQ(log_.noted[0].end, WriteEnd::busy);
  EXPECT_EQ(log_.noted[0].kind, Kind::denied);
}

}  // namespace
}  // namespace baudgate::audit
