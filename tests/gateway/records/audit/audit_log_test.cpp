// The audit with its thread, on disks that work, hang and fail.
// SPDX-License-Identifier: Apache-2.0
#include "gateway/records/audit/audit_log.h"

#include <gmock/gmock.h>
#include <sqlite3.h>

#include "tests/gateway/records/audit/faulty_disk.h"
#include "tests/gateway/records/audit/fixture.h"

namespace baudgate::audit {
namespace {

using ::testing::HasSubstr;
using Written = WriteLog::Written;

/// An event that comes for certain; nothing is concluded from how soon.
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
  static void Await(const AuditLog& log, Disk disk) {
    while (log.state().disk != disk) std::this_thread::yield();
  }

 private:
  std::mutex mutex_;
  std::vector<std::string> heard_;
};

TEST_F(AuditLogTest, KeepsAndCompletes) {
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
    EXPECT_EQ(log->state().disk, Disk::fine);
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

TEST_F(AuditLogTest, ADiskThatHangsHoldsUpNobody) {
  FaultyDisk disk;
  const auto log = Start("/events.db", disk.vfs());
  Await(*log, Disk::fine);
  disk.Hang(true);
  const auto first = log->Begin(WrittenPoint("a"));
  disk.WaitUntilItHangs();
  EXPECT_EQ(log->WaitFor(*first, Instant{}), Written::late) << "the time is over";
  EXPECT_EQ(log->state().disk, Disk::stalled);
  const auto second = log->Begin(WrittenPoint("b"));
  EXPECT_EQ(log->WaitFor(*second, Ever()), Written::late) << "known to hang: nobody waits for it";
  EXPECT_EQ(log->state().waiting, 2U);
  disk.Hang(false);
  Await(*log, Disk::fine);
  EXPECT_EQ(log->WaitFor(*second, Ever()), Written::yes);
  ASSERT_EQ(heard().size(), 2U) << "its begin and its end";
  EXPECT_THAT(heard()[0],
              HasSubstr("warn: audit: the disk does not answer in time; writes are sent"));
  EXPECT_THAT(heard()[1], HasSubstr("inform: audit: writes are recorded again"));
}

TEST_F(AuditLogTest, ADiskThatHangsIsShownWhereNobodyWaitsForARecord) {
  FaultyDisk disk;
  const auto log = Start("/events.db", disk.vfs());
  Await(*log, Disk::fine);
  disk.Hang(true);
  log->Begin(WrittenPoint("a"));
  disk.WaitUntilItHangs();
  for (int ticks = 0; ticks < FileWatch::kMostTicks; ++ticks) log->Watch();
  EXPECT_EQ(log->state().disk, Disk::fine);
  log->Watch();
  EXPECT_EQ(log->state().disk, Disk::stalled);
  disk.Hang(false);
  Await(*log, Disk::fine);
}

TEST_F(AuditLogTest, AFileIsLookedAtAlsoWhereNothingIsWritten) {
  const auto log = Start(file());
  const auto ticket = log->Begin(WrittenPoint("a"));
  ASSERT_EQ(log->WaitFor(*ticket, Ever()), Written::yes);
  std::filesystem::resize_file(file().string() + "-wal", 0);
  for (int ticks = 0; ticks < FileWatch::kLookEvery; ++ticks) log->Watch();
  while (heard().size() < 2) std::this_thread::yield();
  EXPECT_THAT(heard()[0], HasSubstr("its write-ahead log (-wal) was shortened or damaged"));
  EXPECT_THAT(heard()[1], HasSubstr("writes are recorded again"));
  log->End(*ticket, {WriteEnd::ok, {}, 3ms});
}

/// The table may not be there yet: whoever reads then is told that there is nothing so far.
TEST_F(AuditLogTest, AFileThatIsBeingOpenedHasNothingYet) {
  FaultyDisk disk;
  disk.Hang(true);
  const auto log = Start(file().string(), disk.vfs());
  disk.WaitUntilItHangs();
  EXPECT_EQ(log->state().disk, Disk::opening);
  const auto page = log->Read({.after = 7, .since = {}});
  disk.Hang(false);
  ASSERT_TRUE(page) << page.error();
  EXPECT_TRUE(page->records.empty());
  EXPECT_EQ(page->next, 7);
}

TEST_F(AuditLogTest, WhatWasAskedBeforeIsKnownOnceTheFileIsOpen) {
  {
    const auto log = Start(file());
    WriteRecord record = WrittenPoint("dds:a");
    record.request = {"hmi-1", 7, "feeder-1 group 3"};
    log->WaitFor(*log->Begin(record), Ever());
  }
  const auto log = Start(file());
  std::optional<PastRequests> past;
  while (!(past = log->Past())) std::this_thread::yield();
  ASSERT_EQ(past->all.size(), 1U);
  EXPECT_TRUE(past->complete);
  EXPECT_EQ(past->all[0].end, WriteEnd::unknown);
  EXPECT_TRUE(Start({})->Past()->all.empty()) << "no place for records";
}

TEST_F(AuditLogTest, WhileTheFileCanNotBeReadThePastIsNotKnown) {
  const auto log = Start(file() / "no folder");
  Await(*log, Disk::failing);
  const auto past = log->Past();
  ASSERT_TRUE(past) << "best effort: writes go on";
  EXPECT_FALSE(past->complete);
}

TEST_F(AuditLogTest, AFullDiskIsToldOnceAndTheRecordsFollow) {
  FaultyDisk disk;
  const auto log = Start("/events.db", disk.vfs());
  Await(*log, Disk::fine);
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
  Await(*log, Disk::fine);
  EXPECT_EQ(log->state().waiting, 0U);
  EXPECT_EQ(heard().size(), 2U);
}

/// rm events.db*, with a gateway running.
TEST_F(AuditLogTest, AFileThatIsRemovedIsNoticedAndBegunAnew) {
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
  EXPECT_THAT(heard(), ::testing::Contains(HasSubstr("it was removed")));
}

TEST_F(AuditLogTest, AFolderThatIsRemovedIsATrouble) {
  const auto log = Start(file());
  const auto first = log->Begin(WrittenPoint("a"));
  ASSERT_EQ(log->WaitFor(*first, Ever()), Written::yes);
  std::filesystem::remove_all(folder_);
  log->Begin(WrittenPoint("b"));
  Await(*log, Disk::failing);
}

TEST_F(AuditLogTest, WithoutAPlaceTheStateSaysSo) {
  const auto log = Start({});
  const auto ticket = log->Begin(WrittenPoint("a"));
  EXPECT_EQ(log->WaitFor(*ticket, Ever()), Written::failing);
  EXPECT_EQ(log->state().trouble, "there is no place for it");
  EXPECT_FALSE(log->Read({}));
  ASSERT_EQ(heard().size(), 1U);
}

TEST_F(AuditLogTest, WhatIsLostAtTheEndIsTold) {
  FaultyDisk disk;
  disk.open_error = SQLITE_CANTOPEN;
  {
    const auto log = Start("/events.db", disk.vfs());
    log->Begin(WrittenPoint("a"));
  }
  EXPECT_THAT(heard().back(), HasSubstr("1 records of writes are lost"));
}

}  // namespace
}  // namespace baudgate::audit
