// Alarms while their disk works, fails and hangs; who has seen them, and which the configuration
// still has.
// SPDX-License-Identifier: Apache-2.0
#include <sqlite3.h>

#include <future>

#include "tests/gateway/records/events/event_log_fixture.h"

namespace baudgate::events {
namespace {

using audit::FaultyDisk;
using ::testing::Contains;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

EventRecord Raised(const std::string& name) {
  EventRecord record;
  record.line = "bay-1";
  record.device = "feeder-1";
  record.text = record.subject = name;
  record.mark = {.step = AlarmMark::Step::raise, .priority = config::AlarmPriority::high};
  return record;
}
Watched Only(const std::string& name,
             config::AlarmPriority priority = config::AlarmPriority::high) {
  return [=](const Alarm& alarm) {
    return alarm.name == name ? std::optional(priority) : std::nullopt;
  };
}
Acknowledged Ack(EventLog& log, const AckQuery& query) {
  std::promise<Acknowledged> done;
  log.Acknowledge(query, [&done](const Acknowledged& told) { done.set_value(told); });
  return done.get_future().get();
}

std::vector<std::string> AlarmsIn(const std::vector<std::string>& heard) {
  std::vector<std::string> alarms;
  for (const std::string& line : heard) {
    if (line.starts_with("alarm: ")) alarms.push_back(line.substr(7));
  }
  return alarms;
}

/// The disk that fails is an alarm itself: it must not wait for that disk. Each change is told
/// once, whenever it is kept.
TEST_F(EventLogTest, AlarmsAreKnownWhileTheDiskFails) {
  FaultyDisk disk;
  const auto log = Start("/events.db", disk.vfs());
  log->queue().Add(BatchOf(0, "a"));
  AwaitKept(1);
  disk.write_error = SQLITE_FULL;
  log->queue().Tell(Raised("disk"));
  while (log->Alarms().empty()) std::this_thread::yield();
  EXPECT_EQ(log->state().alarms_active, 1U);
  EXPECT_NE(Ack(*log, {.all = true, .by = "user:anna"}).trouble, "");
  while (log->Alarms()[0].state != AlarmState::acknowledged) std::this_thread::yield();
  while (AlarmsIn(heard()).size() < 2) std::this_thread::yield();
  disk.write_error = 0;
  while (log->state().disk != Disk::fine) std::this_thread::yield();
  log->queue().Tell(Raised("next"));
  while (AlarmsIn(heard()).size() < 3) std::this_thread::yield();
  EXPECT_THAT(AlarmsIn(heard()),
              ElementsAre("disk raised active", "disk acknowledged", "next raised active"));
  EXPECT_EQ(log->Alarms().size(), 2U);
}

TEST_F(EventLogTest, AlarmsAreKnownWhileTheDiskHangs) {
  FaultyDisk disk;
  const auto log = Start("/events.db", disk.vfs());
  log->queue().Add(BatchOf(0, "a"));
  AwaitKept(1);
  disk.Hang(true);
  log->queue().Tell(Raised("first"));
  disk.WaitUntilItHangs();
  for (int ticks = 0; ticks < FileWatch::kMostTicks; ++ticks) log->Watch();
  EXPECT_EQ(log->state().disk, Disk::fine) << "it may just be slow";
  log->queue().Tell(Raised("second"));
  log->Watch();
  EXPECT_EQ(log->state().disk, Disk::stalled);
  EXPECT_EQ(log->state().alarms_active, 2U);
  EXPECT_THAT(heard(), Contains(HasSubstr("warn: events: the disk does not answer in time")));
  EXPECT_NE(Ack(*log, {.all = true, .by = "user:anna"}).trouble, "") << "nobody waits for it";
  log->Watch();
  disk.Hang(false);
  while (log->state().disk != Disk::fine || log->state().waiting > 0) std::this_thread::yield();
  log->queue().Tell(Raised("third"));
  while (AlarmsIn(heard()).size() < 5) std::this_thread::yield();
  EXPECT_THAT(AlarmsIn(heard()),
              ElementsAre("first raised active", "second raised active", "first acknowledged",
                          "second acknowledged", "third raised active"))
      << "each once";
}

TEST_F(EventLogTest, AlarmsAreKnownWhereThereIsNoPlaceForTheFile) {
  const auto log = Start({});
  log->queue().Tell(Raised("disk"));
  while (log->Alarms().empty()) std::this_thread::yield();
  while (AlarmsIn(heard()).empty()) std::this_thread::yield();
  EXPECT_THAT(AlarmsIn(heard()), ElementsAre("disk raised active"));
}

TEST_F(EventLogTest, KeepsAlarmsAndWhoHasSeenThem) {
  const AckQuery of_device{.line = "bay-1", .device = "feeder-1", .by = "user:anna"};
  {
    const auto log = Start(file());
    log->queue().Tell(Raised("a"));
    log->queue().Tell(Raised("b"));
    while (log->state().newest < 2) std::this_thread::yield();
    EXPECT_EQ(log->state().alarms_active, 2U);
    EXPECT_EQ(log->state().alarms_unacknowledged, 2U);
    const Acknowledged one = Ack(*log, {.seq = 1, .by = "user:bob"});
    EXPECT_EQ(one.alarms, 1U);
    EXPECT_EQ(one.trouble, "");
    EXPECT_EQ(log->state().newest, 3) << "it is on the disk when it is told";
    EXPECT_EQ(log->state().alarms_unacknowledged, 1U);
    EXPECT_EQ(Texts(*log).back(), "acknowledged by user:bob: a");
    EXPECT_EQ(Ack(*log, {.seq = 1}).alarms, 0U);
  }
  const auto log = Start(file());
  EXPECT_EQ(Ack(*log, {.line = "bay-1", .device = "feeder-2"}).alarms, 0U);
  while (log->state().disk != Disk::fine) std::this_thread::yield();
  EXPECT_EQ(Ack(*log, of_device).alarms, 1U);
  const auto alarms = log->Alarms();
  ASSERT_EQ(alarms.size(), 2U);
  EXPECT_EQ(alarms[0].name, "a");
  EXPECT_EQ(alarms[0].by, "user:bob");
  EXPECT_EQ(alarms[1].by, "user:anna");
  EXPECT_EQ(alarms[1].state, AlarmState::acknowledged);
  EXPECT_EQ(alarms[1].priority, config::AlarmPriority::high);
  std::filesystem::remove(file());
  log->queue().Tell(Raised("c"));
  while (log->state().newest < 5) std::this_thread::yield();
  Database database(file().string(), Database::Mode::read);
  EXPECT_EQ(ToText(database.First("SELECT count(*) FROM alarms")), "3") << "in the new file, too";
}

TEST_F(EventLogTest, ForgetsAlarmsThatNobodyWatches) {
  {
    const auto log = Start(file());
    log->queue().Tell(Raised("a"));
    log->queue().Tell(Raised("b"));
  }
  watches_ = Only("b");
  const auto log = Start(file());
  while (log->state().newest < 3) std::this_thread::yield();
  EXPECT_EQ(Texts(*log).back(), "not in the configuration any more: a");
  EXPECT_EQ(log->state().alarms_active, 1U);
  EXPECT_EQ(log->state().alarms_unacknowledged, 2U) << "nobody has seen it yet";
}

TEST_F(EventLogTest, AReloadEndsAlarmsThatNobodyWatchesAnyMore) {
  const auto log = Start(file());
  log->queue().Tell(Raised("a"));
  log->queue().Tell(Raised("b"));
  while (log->state().newest < 2) std::this_thread::yield();
  log->queue().Tell(Raised("c"));  // maybe not on the disk yet
  log->queue().Renumber({{"bay-1", "feeder-1"}}, Only("b"));
  while (log->state().newest < 5) std::this_thread::yield();
  EXPECT_THAT(Texts(*log), ElementsAre("a", "b", "c", "not in the configuration any more: a",
                                       "not in the configuration any more: c"));
  EXPECT_EQ(log->state().alarms_active, 1U);
  EXPECT_EQ(log->state().alarms_unacknowledged, 3U);
}

TEST_F(EventLogTest, AChangedPriorityReachesAnActiveAlarm) {
  const auto log = Start(file());
  log->queue().Tell(Raised("a"));
  while (log->state().newest < 1) std::this_thread::yield();
  log->queue().Renumber({{"bay-1", "feeder-1"}}, Only("a", config::AlarmPriority::low));
  while (log->state().newest < 2) std::this_thread::yield();
  EXPECT_THAT(Texts(*log), ElementsAre("a", "priority low, was high: a"));
  const auto alarms = log->Alarms();
  ASSERT_EQ(alarms.size(), 1U);
  EXPECT_EQ(alarms[0].priority, config::AlarmPriority::low);
  EXPECT_EQ(alarms[0].state, AlarmState::active);
  EXPECT_EQ(alarms[0].text, "a") << "that of the event that raised it";
}

TEST_F(EventLogTest, SaysThatAnAcknowledgementWaits) {
  FaultyDisk disk;
  const auto log = Start("/events.db", disk.vfs());
  log->queue().Tell(Raised("a"));
  while (log->state().newest < 1) std::this_thread::yield();
  disk.write_error = SQLITE_FULL;
  const Acknowledged done = Ack(*log, {.seq = 1});
  EXPECT_EQ(done.alarms, 1U);
  EXPECT_THAT(done.trouble, HasSubstr("full"));
  disk.write_error = 0;
  while (log->state().alarms_unacknowledged > 0) std::this_thread::yield();
}

}  // namespace
}  // namespace baudgate::events
