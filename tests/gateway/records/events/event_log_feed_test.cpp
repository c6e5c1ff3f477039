// What outputs get of the events: from memory, and from the file where they have been away.
// SPDX-License-Identifier: Apache-2.0
#include <sqlite3.h>

#include "tests/gateway/records/events/event_log_fixture.h"

namespace baudgate::events {
namespace {

using audit::FaultyDisk;

TEST_F(EventLogTest, KeepsThePlaceOfAConsumerAndReadsWhatHasLeftTheMemory) {
  const auto begin = [this] {
    feed_ = std::make_shared<EventFeed>(FeedLimits{.events = 10});
    cursors_ = std::make_shared<CursorBook>(std::set<std::string>{"dds"});
  };
  begin();
  const auto take = [this](std::int64_t after) {
    for (;;) {
      if (auto events = feed_->Take(after, 100); !events.empty()) return events;
      std::this_thread::yield();
    }
  };
  {
    const auto log = Start(file());
    Batch batch = BatchOf(0, "a");
    for (int i = 0; i < 499; ++i) batch.events.push_back(batch.events.front());
    log->queue().Add(batch);
    AwaitKept(1);
    EXPECT_EQ(take(495).size(), 5U);
    const auto read = take(20);
    ASSERT_EQ(read.size(), 100U);
    EXPECT_EQ(read.front().record.seq, 21);
    EXPECT_EQ(read.back().source, 0U);
    EXPECT_EQ(take(120).back().record.seq, 220) << "of the same page";
    EXPECT_EQ(take(220).back().record.seq, 320);
    cursors_->Set("dds", {320, true});
    EXPECT_EQ(log->state().consumers.front().lost, 0);
  }
  begin();
  const auto log = Start(file());
  while (!cursors_->Of("dds")) std::this_thread::yield();
  EXPECT_EQ(cursors_->Of("dds"), (Cursor{320, true}));
  EXPECT_EQ(take(320).front().record.seq, 321);
  // A file that lacks what he has not had.
  std::filesystem::remove(file());
  log->queue().Add(BatchOf(0, "b"));
  AwaitKept(2);
  EXPECT_EQ(take(330).front().record.seq, 492) << "what is in memory";
  EXPECT_EQ(log->state().oldest, 501);
  ASSERT_EQ(log->state().consumers.size(), 1U);
  EXPECT_EQ(log->state().consumers[0].lost, 180);
  cursors_->Set("dds", {501, false});
  for (Database database(file().string(), Database::Mode::read);;) {
    if (ToText(database.First("SELECT seq FROM event_cursors")) == "501") break;
    std::this_thread::yield();
  }
}

TEST_F(EventLogTest, FeedsItsEndOnceWhileOutputsStillRun) {
  auto log = Start(file(), {}, {}, true);
  log->queue().Started("1");
  log->queue().End(1h);
  EXPECT_EQ(Fed(), (std::vector<std::string>{"baudgate 1 has started", "the gateway ends"}));
  log.reset();
  EXPECT_EQ(Fed().size(), 2U);
  feed_ = std::make_shared<EventFeed>();
  Start(file(), {}, {}, true)->queue().Started("2");
  EXPECT_EQ(Fed().back(), "the gateway ends") << "also where nobody asked for it before";
}

TEST_F(EventLogTest, EndsWithoutADiskThatFails) {
  FaultyDisk disk;
  disk.write_error = SQLITE_FULL;
  const auto log = Start("/events.db", disk.vfs(), {}, true);
  log->queue().Started("1");
  log->queue().End(1h);
  EXPECT_TRUE(Fed().empty());
  disk.write_error = 0;
}

TEST_F(EventLogTest, FeedsWhatTheGatewayHasSeenOfADeviceAsTheDevices) {
  const auto log = Start(file(), {}, {}, true);
  log->queue().Started("1");
  EventRecord record;
  record.line = "bay-1";
  record.device = "feeder-2";
  record.text = "does not answer";
  log->queue().Tell(record);
  while (Fed().size() < 2) std::this_thread::yield();
  const auto fed = feed_->Take(0, 10);
  EXPECT_EQ(fed[0].source, kGateway);
  EXPECT_EQ(fed[1].source, 1U);
  EXPECT_EQ(fed[1].record.text, "does not answer");
}

/// A reload gives a device another number while its batch is being written.
TEST_F(EventLogTest, FeedsUnderTheNumberOfAfterAReloadWhatWasBeingWritten) {
  FaultyDisk disk;
  const auto log = Start("/events.db", disk.vfs(), {}, true);
  log->queue().Add(BatchOf(0, "a"));
  AwaitKept(1);
  disk.Hang(true);
  log->queue().Add(BatchOf(1, "12.345 E1"));
  EventRecord own;
  own.line = "bay-1";
  own.device = "feeder-2";
  log->queue().Tell(own);
  disk.WaitUntilItHangs();
  log->queue().Renumber({{"", ""}, {"", ""}, {"bay-1", "feeder-1"}, {"bay-1", "feeder-2"}}, {});
  disk.Hang(false);
  AwaitKept(2);
  while (Fed().size() < 3) std::this_thread::yield();
  EXPECT_EQ(feed_->Show(2, 0, 7).events.size(), 1U);
  EXPECT_EQ(feed_->Show(3, 0, 7).events.size(), 2U);
  EXPECT_EQ(feed_->Show(1, 0, 7).events.size(), 0U);
}

/// One reload takes a device out, and a later one brings it back.
TEST_F(EventLogTest, FindsADeviceThatComesBackByItsName) {
  const auto log = Start(file());
  log->queue().Add(BatchOf(1, "12.345 E1"));
  AwaitKept(1);
  log->queue().Renumber({{"", ""}, {"", ""}}, {});
  EXPECT_EQ(feed_->Take(0, 1).front().source, kGateway) << "not configured";
  log->queue().Renumber({{"", ""}, {"", ""}, {"bay-1", "feeder-2"}}, {});
  EXPECT_EQ(log->queue().said(2), "12.345 E1");
  EXPECT_EQ(feed_->Show(2, 0, 7).events.size(), 1U);
  EXPECT_EQ(feed_->Take(0, 1).front().source, 2U);
}

}  // namespace
}  // namespace baudgate::events
