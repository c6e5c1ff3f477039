// The events with their thread, on disks that work and fail, and beside the audit.
// SPDX-License-Identifier: Apache-2.0
#include <sqlite3.h>

#include <fstream>

#include "gateway/records/audit/audit_log.h"
#include "tests/gateway/records/events/event_log_fixture.h"

namespace baudgate::events {
namespace {

using audit::FaultyDisk;
using ::testing::Contains;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

TEST_F(EventLogTest, KeepsOverRestartsAndKnowsWhatComesOnceMore) {
  {
    const auto log = Start(file());
    log->queue().Add(BatchOf(0, "a"));
    log->queue().Add(BatchOf(1, "b"));
    AwaitKept(2);
  }
  feed_ = std::make_shared<EventFeed>();
  const auto log = Start(file());
  log->queue().Add(BatchOf(0, "a", true));
  log->queue().Add(BatchOf(1, "c", true));
  AwaitKept(4);
  EXPECT_EQ(Fed(), (std::vector<std::string>{"a", "b", "c"})) << "the file's first, none twice";
  EXPECT_EQ(Texts(*log), (std::vector<std::string>{"a", "b", "c"}));
  EXPECT_EQ(log->state().newest, 3);
  EXPECT_EQ(log->state().repeats, 1U);
  EXPECT_EQ(log->state().disk, Disk::fine);
}

TEST_F(EventLogTest, WaitsForADiskThatFails) {
  FaultyDisk disk;
  const auto log = Start("/events.db", disk.vfs());
  log->queue().Add(BatchOf(0, "a"));
  AwaitKept(1);
  disk.write_error = SQLITE_FULL;
  log->queue().Add(BatchOf(0, "b"));
  while (log->state().disk != Disk::failing) std::this_thread::yield();
  EXPECT_EQ(log->state().waiting, 1U);
  EXPECT_EQ(Fed(), (std::vector<std::string>{"a"})) << "nothing is shown before its commit";
  EXPECT_FALSE(log->state().trouble.empty());
  disk.write_error = 0;
  AwaitKept(2);
  while (log->state().disk != Disk::fine) std::this_thread::yield();
  EXPECT_EQ(log->state().newest, 2);
  EXPECT_EQ(Fed(), (std::vector<std::string>{"a", "b"}));
  const auto lines = heard();
  ASSERT_EQ(lines.size(), 2U);
  EXPECT_THAT(lines[0], HasSubstr("devices are not asked for events"));
  EXPECT_THAT(lines[1], HasSubstr("inform: events: they are kept again"));
}

TEST_F(EventLogTest, SaysSoWhereThereIsNoPlace) {
  const auto log = Start({});
  EXPECT_EQ(log->state().disk, Disk::failing);
  EXPECT_FALSE(log->Read({}));
}

TEST_F(EventLogTest, BeginsANewFileWhereTheOldOneIsRemoved) {
  const auto log = Start(file());
  log->queue().Add(BatchOf(0, "a"));
  AwaitKept(1);
  std::filesystem::remove(file());
  log->queue().Add(BatchOf(0, "b"));
  AwaitKept(2);
  const auto page = log->Read({});
  ASSERT_TRUE(page) << page.error();
  ASSERT_EQ(page->records.size(), 1U);
  EXPECT_EQ(page->records[0].seq, 2) << "no number comes twice";
}

TEST_F(EventLogTest, TellsHowTheGatewayHasStartedAndEnded) {
  const auto run = [this](const std::string& version) {
    const auto log = Start(file(), {}, {}, true);
    log->queue().Started(version);
    log->queue().Add(BatchOf(0, version));
  };
  run("1");
  run("2");
  const auto log = Start(file(), {}, {}, true);
  log->queue().Started("3");
  while (log->state().newest < 7) std::this_thread::yield();
  const auto texts = Texts(*log);
  ASSERT_EQ(texts.size(), 7U);
  EXPECT_EQ(texts[0], "baudgate 1 has started");
  EXPECT_EQ(texts[1], "1");
  EXPECT_EQ(texts[2], "the gateway ends");
  EXPECT_EQ(texts[3], "baudgate 2 has started; the run before ended in order");
  // A gateway that is killed writes nothing any more.
  const std::string other = (file().parent_path() / "killed.db").string();
  std::filesystem::copy(file(), other);
  std::filesystem::copy(file().string() + "-wal", other + "-wal");
  const auto next = Start(other, {}, {}, true);
  next->queue().Started("4");
  while (next->state().newest < 8) std::this_thread::yield();
  EXPECT_THAT(Texts(*next).back(), HasSubstr("4 has started; the run before was broken off after"));
}

/// Nothing is written, so nobody else would find out.
TEST_F(EventLogTest, WhatAReaderFindsDamagedIsPutAsideAtTheNextLook) {
  const auto log = Start(file());
  log->queue().Add(BatchOf(0, "a"));
  AwaitKept(1);
  {
    // Behind its head nothing is right any more.
    Database other(file().string(), Database::Mode::write);
    ASSERT_TRUE(other.EmptyLog());
    constexpr int kHeader = 100;
    std::fstream bytes(file(), std::ios::in | std::ios::out | std::ios::binary);
    bytes.seekp(kHeader);
    bytes << std::string(std::filesystem::file_size(file()) - kHeader, 'x');
  }
  EXPECT_FALSE(log->Read({}));
  EXPECT_TRUE(log->state().put_aside.empty());
  for (int ticks = 0; ticks < FileWatch::kLookEvery; ++ticks) log->Watch();
  while (log->state().put_aside.empty()) std::this_thread::yield();
  EXPECT_THAT(log->state().put_aside, ElementsAre(file().filename().string() + ".bad"));
  EXPECT_THAT(heard(), Contains(HasSubstr("is damaged (")));
  EXPECT_TRUE(log->Read({})) << "a new one has begun";
  std::filesystem::remove(file().string() + ".bad");
  for (int ticks = 0; ticks < FileWatch::kLookEvery; ++ticks) log->Watch();
  while (!log->state().put_aside.empty()) std::this_thread::yield();
}

TEST_F(EventLogTest, TellsThatTheDiskHasFailed) {
  FaultyDisk disk;
  const auto log = Start("/events.db", disk.vfs(), {}, true);
  log->queue().Add(BatchOf(0, "a"));
  AwaitKept(1);
  disk.write_error = SQLITE_FULL;
  log->queue().Add(BatchOf(0, "b"));
  while (log->state().disk != Disk::failing) std::this_thread::yield();
  disk.write_error = 0;
  while (log->state().newest < 3) std::this_thread::yield();
  EXPECT_EQ(log->state().disk, Disk::fine);
  EXPECT_EQ(log->state().waiting, 0U);
}

/// Both write without a pause: neither is ever told that the file is busy.
TEST_F(EventLogTest, SharesTheThreadOfTheFileWithTheAudit) {
  const auto writer = std::make_shared<EventsWriter>();
  const auto log = Start(file(), {}, writer);
  audit::AuditLog writes({.file = file(),
                          .writer = writer,
                          .clocks = ReadClocks,
                          .warn = [this](const std::string& text) { Hear("warn", text); },
                          .inform = [this](const std::string& text) { Hear("inform", text); }});
  constexpr int kRounds = 100;
  std::thread other([&] {
    for (int i = 0; i < kRounds; ++i) {
      const auto ticket = writes.Begin(audit::WrittenPoint("c" + std::to_string(i)));
      ASSERT_TRUE(ticket);
      EXPECT_EQ(writes.WaitFor(*ticket, ReadClocks().instant + 60s), audit::WriteLog::Written::yes);
    }
  });
  for (std::size_t i = 0; i < kRounds; ++i) {
    log->queue().Add(BatchOf(0, std::to_string(i)));
    AwaitKept(i + 1);
  }
  other.join();
  EXPECT_EQ(Texts(*log).size(), static_cast<std::size_t>(kRounds));
  EXPECT_TRUE(heard().empty());
}

TEST_F(EventLogTest, TellsWhatIsOwedAndAgainAfterARestart) {
  {
    const auto log = Start(file());
    Batch batch = BatchOf(0, "tripped");
    batch.events[0].record = "trip";
    log->queue().Add(std::move(batch));
    log->queue().Add(BatchOf(1, "reset"));
    AwaitKept(2);
    EXPECT_THAT(owed(), ElementsAre(1));
    EXPECT_EQ(log->Read({})->records.at(0).record, "trip");
  }
  {
    const auto log = Start(file());
    log->queue().Add(BatchOf(1, "again"));
    AwaitKept(3);
    EXPECT_THAT(owed(), ElementsAre(1, 1));
    KeptRecord record;
    record.kind = kEventRecord;
    record.event = 1;
    record.name = "trip";
    record.values = {{"phases", std::int64_t{4}}};
    log->queue().Keep(record);  // the log ends behind it
  }
  const auto log = Start(file());
  log->queue().Add(BatchOf(0, "more"));
  AwaitKept(4);
  EXPECT_THAT(owed(), ElementsAre(1, 1));
  ASSERT_TRUE(log->Read({})->records.at(0).kept);
  EXPECT_EQ(log->Read({})->records.at(0).kept->values.at(0).name, "phases");
}

/// A reload ends the line and begins it anew: its devices have other numbers, and are the same.
TEST_F(EventLogTest, WhatWaitsForTheDiskKeepsItsNameBeyondAReload) {
  FaultyDisk disk;
  const auto log = Start("/events.db", disk.vfs());
  disk.write_error = SQLITE_FULL;
  log->queue().Add(BatchOf(1, "12.345 E1"));
  log->queue().Renumber({{"", ""}, {"", ""}}, {});
  log->queue().Renumber({{"bay-1", "feeder-2"}}, {});
  disk.write_error = 0;
  AwaitKept(1);
  const auto again = Start("/events.db", disk.vfs());
  again->queue().Add(BatchOf(1, "12.345 E1", true));
  while (again->state().repeats < 1) std::this_thread::yield();
}

TEST_F(EventLogTest, WhatADeviceHasSaidGoesWithItsName) {
  {
    const auto log = Start(file());
    log->queue().Add(BatchOf(1, "12.345 E1"));
    AwaitKept(1);
    log->queue().Renumber({{"", ""}, {"", ""}, {"bay-1", "feeder-2"}}, {});
    EXPECT_EQ(log->queue().said(2), "12.345 E1");
    EXPECT_EQ(feed_->Show(2, 0, 7).events.size(), 1U);
    EXPECT_EQ(feed_->Show(1, 0, 7).events.size(), 0U);
    log->queue().Add(BatchOf(2, "12.345 E1", true));  // once more: it did not hear that it was kept
    log->queue().Add(BatchOf(2, "12.346 E2"));
    AwaitKept(3);
    EXPECT_EQ(log->state().repeats, 1U);
  }
  const auto page = ReadPage(file(), {});
  ASSERT_TRUE(page) << page.error();
  EXPECT_EQ(page->records.size(), 2U);
}

}  // namespace
}  // namespace baudgate::events
