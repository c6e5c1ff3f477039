// Tests of `AuditLog` with its thread, of `AuditBook`, and of both when the power fails.
// SPDX-License-Identifier: Apache-2.0
#include "gateway/records/audit/audit_log.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sqlite3.h>

#include <map>
#include <set>

#include "tests/gateway/records/audit/faulty_disk.h"
#include "tests/gateway/records/audit/fixture.h"
#include "tests/support/long_run.h"

namespace baudgate::audit {
namespace {

using ::testing::HasSubstr;
using Written = WriteLog::Written;

Instant Ever() { return ReadClocks().instant + 60s; }

class AuditLogTest : public FolderTest {
 protected:
  std::unique_ptr<AuditLog> Start(const std::filesystem::path& path, const std::string& vfs = {}) {
    AuditLog::Options options;
    options.file = path;
    options.vfs = vfs;
    options.why_no_file = "there is no place for it";
    options.clocks = ReadClocks;
    options.warn = [this](const std::string& text) { Hear("warn", text); };
    options.inform = [this](const std::string& text) { Hear("inform", text); };
    return std::make_unique<AuditLog>(std::move(options));
  }
  void Hear(const std::string& how, const std::string& text) {
    const std::lock_guard lock(mutex_);
    heard_.push_back(how + ": " + text);
  }
  std::vector<std::string> heard() {
    const std::lock_guard lock(mutex_);
    return heard_;
  }
  static void Await(const AuditLog& log, records::Disk disk) {
    while (log.state().disk != disk) std::this_thread::yield();
  }

 private:
  std::mutex mutex_;
  std::vector<std::string> heard_;
};

TEST_F(AuditLogTest, RecordsAWriteAndCompletesItsRecord) {
  {
    const auto log = Start(file());
    const auto ticket = log->Begin(WrittenPoint("a"));
    ASSERT_TRUE(ticket);
    EXPECT_EQ(log->WaitFor(*ticket, Ever()), Written::yes);
    const auto page = log->Read({});
    ASSERT_TRUE(page) << page.error();
    ASSERT_EQ(page->records.size(), 1U);
    EXPECT_EQ(OutcomeOf(page->records[0]), "pending");
    log->End(*ticket, {WriteEnd::ok, {}, 3ms});
    log->Note(RouteWrite("b", 1), ReadClocks().instant);
    log->Note(RouteWrite("b", 2), ReadClocks().instant);
    EXPECT_EQ(log->state().disk, records::Disk::fine);
  }
  const auto rows = ReadAll(file());
  ASSERT_EQ(rows.size(), 2U);
  EXPECT_EQ(rows[0].end, WriteEnd::ok);
  EXPECT_EQ(rows[1].count, 2U) << "an orderly end closes what is open";
  EXPECT_TRUE(rows[1].settled);
  EXPECT_TRUE(heard().empty()) << heard()[0];
}

TEST_F(AuditLogTest, ManyThreadsShareCommitsAndNothingIsLost) {
  constexpr int kThreads = 8;
  constexpr int kEach = 50;
  {
    const auto log = Start(file());
    std::vector<std::thread> threads;
    for (int i = 0; i < kThreads; ++i) {
      threads.emplace_back([&log, i] {
        for (int n = 0; n < kEach; ++n) {
          const auto ticket = log->Begin(WrittenPoint(std::to_string(i * kEach + n)));
          if (log->WaitFor(*ticket, Ever()) == Written::yes) log->End(*ticket, {WriteEnd::ok});
        }
      });
    }
    for (std::thread& thread : threads) thread.join();
  }
  const auto rows = ReadAll(file());
  EXPECT_EQ(rows.size(), std::size_t{kThreads} * kEach);
  for (const WriteRecord& row : rows) EXPECT_EQ(row.end, WriteEnd::ok);
}

TEST_F(AuditLogTest, AHangingDiskDelaysNoWrite) {
  FaultyDisk disk;
  const auto log = Start("/events.db", disk.vfs());
  Await(*log, records::Disk::fine);
  disk.Hang(true);
  const auto first = log->Begin(WrittenPoint("a"));
  disk.WaitUntilItHangs();
  EXPECT_EQ(log->WaitFor(*first, Instant{}), Written::late) << "the time is over";
  EXPECT_EQ(log->state().disk, records::Disk::stalled);
  const auto second = log->Begin(WrittenPoint("b"));
  EXPECT_EQ(log->WaitFor(*second, Ever()), Written::late) << "known to hang: nobody waits for it";
  EXPECT_EQ(log->state().waiting, 2U);
  disk.Hang(false);
  Await(*log, records::Disk::fine);
  EXPECT_EQ(log->WaitFor(*second, Ever()), Written::yes);
  ASSERT_EQ(heard().size(), 2U) << "its begin and its end";
  EXPECT_THAT(heard()[0], HasSubstr("warn: audit: the disk does not answer in time (check it with "
                                    "dmesg); writes are still sent"));
  EXPECT_THAT(heard()[1], HasSubstr("inform: audit: writes are recorded again"));
}

TEST_F(AuditLogTest, AHangingDiskIsShownWithoutWaitingWrites) {
  FaultyDisk disk;
  const auto log = Start("/events.db", disk.vfs());
  Await(*log, records::Disk::fine);
  disk.Hang(true);
  log->Begin(WrittenPoint("a"));
  disk.WaitUntilItHangs();
  for (int ticks = 0; ticks < records::FileWatch::kMostTicks; ++ticks) log->Watch();
  EXPECT_EQ(log->state().disk, records::Disk::fine);
  log->Watch();
  EXPECT_EQ(log->state().disk, records::Disk::stalled);
  disk.Hang(false);
  Await(*log, records::Disk::fine);
}

TEST_F(AuditLogTest, TheFileIsCheckedAlsoWithoutWrites) {
  const auto log = Start(file());
  const auto ticket = log->Begin(WrittenPoint("a"));
  ASSERT_EQ(log->WaitFor(*ticket, Ever()), Written::yes);
  std::filesystem::resize_file(file().string() + "-wal", 0);
  for (int ticks = 0; ticks < records::FileWatch::kLookEvery; ++ticks) log->Watch();
  while (heard().size() < 2) std::this_thread::yield();
  EXPECT_THAT(heard()[0], HasSubstr("its write-ahead log (-wal) was shortened or damaged"));
  EXPECT_THAT(heard()[1], HasSubstr("writes are recorded again"));
  log->End(*ticket, {WriteEnd::ok, {}, 3ms});
}

TEST_F(AuditLogTest, ReadReturnsAnEmptyPageWhileTheFileIsOpening) {
  FaultyDisk disk;
  disk.Hang(true);
  const auto log = Start(file().string(), disk.vfs());
  disk.WaitUntilItHangs();
  EXPECT_EQ(log->state().disk, records::Disk::opening);
  const auto page = log->Read({.after = 7, .since = {}});
  disk.Hang(false);
  ASSERT_TRUE(page) << page.error();
  EXPECT_TRUE(page->records.empty());
  EXPECT_EQ(page->next, 7);
}

TEST_F(AuditLogTest, EarlierRequestsAreKnownOnceTheFileIsOpen) {
  {
    const auto log = Start(file());
    WriteRecord record = WrittenPoint("dds:a");
    record.request = {"hmi-1", 7, "feeder-1 group 3"};
    log->WaitFor(*log->Begin(record), Ever());
  }
  const auto log = Start(file());
  std::optional<bus::PastRequests> past;
  while (!(past = log->Past())) std::this_thread::yield();
  ASSERT_EQ(past->all.size(), 1U);
  EXPECT_TRUE(past->complete);
  EXPECT_EQ(past->all[0].end, WriteEnd::unknown);
  EXPECT_TRUE(Start({})->Past()->all.empty()) << "no place for records";
}

TEST_F(AuditLogTest, EarlierRequestsAreIncompleteWhileTheFileIsUnreadable) {
  const auto log = Start(file() / "no folder");
  Await(*log, records::Disk::failing);
  const auto past = log->Past();
  ASSERT_TRUE(past) << "best effort: writes go on";
  EXPECT_FALSE(past->complete);
}

TEST_F(AuditLogTest, AFullDiskIsReportedOnceAndTheRecordsAreWrittenLater) {
  FaultyDisk disk;
  const auto log = Start("/events.db", disk.vfs());
  Await(*log, records::Disk::fine);
  disk.write_error = SQLITE_FULL;
  const auto first = log->Begin(WrittenPoint("a"));
  EXPECT_EQ(log->WaitFor(*first, Ever()), Written::failing);
  log->End(*first, {WriteEnd::ok});
  const auto second = log->Begin(WrittenPoint("b"));
  EXPECT_EQ(log->WaitFor(*second, Ever()), Written::failing);
  EXPECT_THAT(log->state().trouble, HasSubstr("full"));
  EXPECT_THAT(log->Trouble(), HasSubstr("full"));
  EXPECT_EQ(log->state().waiting, 2U);
  disk.write_error = 0;
  Await(*log, records::Disk::fine);
  EXPECT_EQ(log->state().waiting, 0U);
  EXPECT_EQ(heard().size(), 2U);
}

TEST_F(AuditLogTest, ARemovedFileIsNoticedAndCreatedAgain) {
  const auto log = Start(file());
  const auto first = log->Begin(WrittenPoint("a"));
  ASSERT_EQ(log->WaitFor(*first, Ever()), Written::yes);
  for (const char* end : {"", "-wal", "-shm"}) std::filesystem::remove(file().string() + end);
  const auto second = log->Begin(WrittenPoint("b"));
  while (log->WaitFor(*second, Ever()) != Written::yes) std::this_thread::yield();
  const auto page = log->Read({});
  ASSERT_TRUE(page) << page.error();
  ASSERT_FALSE(page->records.empty());
  EXPECT_EQ(page->records.back().client, "b");
  EXPECT_THAT(heard(), ::testing::Contains(HasSubstr("the file was removed")));
}

TEST_F(AuditLogTest, ARemovedFolderIsShownAsFailing) {
  const auto log = Start(file());
  const auto first = log->Begin(WrittenPoint("a"));
  ASSERT_EQ(log->WaitFor(*first, Ever()), Written::yes);
  std::filesystem::remove_all(folder_);
  log->Begin(WrittenPoint("b"));
  Await(*log, records::Disk::failing);
}

TEST_F(AuditLogTest, AMissingPlaceIsShownInTheState) {
  const auto log = Start({});
  const auto ticket = log->Begin(WrittenPoint("a"));
  EXPECT_EQ(log->WaitFor(*ticket, Ever()), Written::failing);
  EXPECT_EQ(log->state().trouble, "there is no place for it");
  EXPECT_FALSE(log->Read({}));
  ASSERT_EQ(heard().size(), 1U);
}

TEST_F(AuditLogTest, RecordsLostAtTheEndAreReported) {
  FaultyDisk disk;
  disk.open_error = SQLITE_CANTOPEN;
  {
    const auto log = Start("/events.db", disk.vfs());
    log->Begin(WrittenPoint("a"));
  }
  EXPECT_THAT(heard().back(), HasSubstr("1 records of writes are lost"));
}

std::vector<Draft> Write(AuditBook& book, std::int64_t& seq) {
  std::vector<Draft> drafts = book.Due();
  for (Draft& draft : drafts) {
    if (draft.record.seq == 0) draft.record.seq = ++seq;
  }
  book.OnWritten(drafts);
  return drafts;
}

TEST(AuditBook, ARecordIsInsertedAndThenCompleted) {
  AuditBook book;
  std::int64_t seq = 0;
  const Ticket ticket = *book.Begin(WrittenPoint("a"));
  EXPECT_EQ(book.unwritten(), 1U);
  EXPECT_LT(book.newest_written(), ticket);
  auto drafts = Write(book, seq);
  ASSERT_EQ(drafts.size(), 1U);
  EXPECT_FALSE(drafts[0].ended);
  EXPECT_EQ(book.newest_written(), ticket);
  EXPECT_FALSE(book.due());
  book.End(ticket, {WriteEnd::refused, "no", 7ms});
  drafts = Write(book, seq);
  ASSERT_EQ(drafts.size(), 1U);
  EXPECT_TRUE(drafts[0].ended);
  EXPECT_EQ(drafts[0].record.seq, 1) << "the same row";
  EXPECT_EQ(drafts[0].record.end, WriteEnd::refused);
  EXPECT_EQ(drafts[0].record.reason, "no");
  book.End(ticket, {WriteEnd::ok});
  EXPECT_FALSE(book.due()) << "it has ended once";
}

TEST(AuditBook, AWriteThatEndsBeforeItsRecordIsStoredIsOneRow) {
  AuditBook book;
  std::int64_t seq = 0;
  book.End(*book.Begin(WrittenPoint("a")), {WriteEnd::ok});
  EXPECT_EQ(Write(book, seq).size(), 1U);
  EXPECT_EQ(seq, 1);
  EXPECT_FALSE(book.due());
}

TEST(AuditBook, AChangeDuringTheWriteIsDueAgain) {
  AuditBook book;
  const Ticket ticket = *book.Begin(WrittenPoint("a"));
  auto drafts = book.Due();
  book.End(ticket, {WriteEnd::ok});
  drafts[0].record.seq = 4;
  book.OnWritten(drafts);
  ASSERT_TRUE(book.due());
  EXPECT_EQ(book.Due()[0].record.seq, 4);
  EXPECT_EQ(book.Due()[0].record.end, WriteEnd::ok);
}

TEST(AuditBook, IsBoundedByKindAndCountsLostRecords) {
  AuditBook book;
  const std::size_t most = AuditBook::kLimits[static_cast<std::size_t>(Kind::route)];
  for (std::size_t i = 0; i < most; ++i) ASSERT_TRUE(book.Begin(RouteWrite("a", 1)));
  EXPECT_FALSE(book.Begin(RouteWrite("a", 1)));
  EXPECT_EQ(book.lost(), 1U);
  EXPECT_TRUE(book.Begin(WrittenPoint("b"))) << "routes take no room of points";
}

TEST(AuditBook, AllRecordsAreInsertedIntoANewFile) {
  AuditBook book;
  std::int64_t seq = 6;
  const Ticket ticket = *book.Begin(WrittenPoint("a"));
  Write(book, seq);
  book.NewFile();
  EXPECT_EQ(book.unwritten(), 1U);
  ASSERT_EQ(book.Due().size(), 1U);
  EXPECT_EQ(book.Due()[0].record.seq, 0);
  seq = 0;
  Write(book, seq);
  book.End(ticket, {WriteEnd::ok});
  EXPECT_EQ(book.Due()[0].record.seq, 1);
}

// ---------------- Random power cuts. No stored record is lost or doubled, no record reports a
// success that did not happen, and the file always opens.

const std::size_t kSeeds = LongRun(400);
constexpr int kLives = 4;

struct Told {
  bool kept = false;
  std::optional<WriteEnd> end;
  bool end_kept = false;
};

class Life {
 public:
  Life(FaultyDisk& disk, std::mt19937& random, std::map<std::string, Told>& told)
      : disk_(disk), random_(random), told_(told), file_(kEventsFile, disk.vfs()) {}

  void Run() {
    disk_.power_left = static_cast<int>(1 + random_() % 250);
    while (!disk_.power_failed()) {
      const auto what = random_() % 8;
      if (what < 3) Begin();
      if (what >= 3 && what < 6) End();
      if (what >= 6) Step();
      disk_.write_error = random_() % 50 == 0 ? SQLITE_FULL : 0;
      disk_.sync_error = random_() % 50 == 0 ? SQLITE_IOERR_FSYNC : 0;
    }
    disk_.write_error = disk_.sync_error = 0;
  }

 private:
  void Begin() {
    const std::string client = "c" + std::to_string(told_.size() + 1);
    const auto ticket = book_.Begin(WrittenPoint(client));
    ASSERT_TRUE(ticket);
    told_[client];
    open_[*ticket] = client;
    here_.insert(client);
  }
  void End() {
    if (open_.empty()) return;
    auto one = open_.begin();
    std::advance(one, static_cast<std::ptrdiff_t>(random_() % open_.size()));
    const WriteEnd end = random_() % 2 == 0 ? WriteEnd::ok : WriteEnd::refused;
    book_.End(one->first, {end, {}, 5ms});
    told_[one->second].end = end;
    open_.erase(one);
  }
  void Step() {
    const bool trouble = disk_.write_error != 0 || disk_.sync_error != 0;
    const Status status = Keep(file_, book_);
    if (!status) {
      EXPECT_TRUE(trouble || disk_.power_failed()) << status.error();
      return;
    }
    for (const std::string& client : here_) {
      Told& one = told_[client];
      one.kept = true;
      one.end_kept = one.end.has_value();
    }
  }

  FaultyDisk& disk_;
  std::mt19937& random_;
  std::map<std::string, Told>& told_;
  AuditBook book_;
  AuditFile file_;
  std::map<Ticket, std::string> open_;
  std::set<std::string> here_;
};

void Check(const std::vector<WriteRecord>& records, const std::map<std::string, Told>& told) {
  std::set<std::string> seen;
  std::int64_t seq = 0;
  for (const WriteRecord& record : records) {
    EXPECT_EQ(record.seq, ++seq) << "without a gap";
    EXPECT_TRUE(seen.insert(record.client).second) << record.client << " is doubled";
    const auto found = told.find(record.client);
    ASSERT_NE(found, told.end());
    ASSERT_TRUE(record.end.has_value()) << "nothing is under way after a restart";
    ASSERT_TRUE(record.settled.has_value());
    const Told& one = found->second;
    if (one.end_kept) {
      EXPECT_EQ(record.end, one.end);
    } else if (record.end != WriteEnd::unknown) {
      EXPECT_EQ(record.end, one.end) << record.client << " claims what nobody has said";
    }
  }
  for (const auto& [client, one] : told) {
    if (!one.kept) continue;
    EXPECT_EQ(seen.count(client), 1U) << client << " is lost";
  }
}

TEST(PowerCut, LosesNoStoredRecord) {
  std::size_t kept = 0;
  for (unsigned seed = 1; seed <= kSeeds && !testing::Test::HasFailure(); ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    std::mt19937 random(seed);
    FaultyDisk disk;
    std::map<std::string, Told> told;
    for (int life = 0; life < kLives; ++life) {
      Life(disk, random, told).Run();
      disk.Restore(random);
    }
    AuditFile file(kEventsFile, disk.vfs());
    const auto opened = file.Open();
    ASSERT_TRUE(opened && opened->ok) << opened->error;
    EXPECT_TRUE(opened->put_aside.empty()) << opened->put_aside;
    const auto records = ReadAll(kEventsFile, disk.vfs());
    Check(records, told);
    kept += records.size();
  }
  EXPECT_GT(kept, 10U * kSeeds) << "there was something to be lost";
}

}  // namespace
}  // namespace baudgate::audit
