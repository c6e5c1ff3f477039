// Tests of `EventLog` with its thread, on disks that work and fail, together with the audit.
// SPDX-License-Identifier: Apache-2.0
#include <sqlite3.h>

#include <fstream>
#include <future>

#include "gateway/records/audit/audit_log.h"
#include "tests/gateway/records/events/event_log_fixture.h"

namespace baudgate::events {
namespace {

using audit::FaultyDisk;
using ::testing::Contains;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

TEST_F(EventLogTest, KeepsEventsOverRestartsAndRecognisesRepeats) {
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
  EXPECT_EQ(log->state().disk, records::Disk::fine);
}

TEST_F(EventLogTest, WaitsForADiskThatFails) {
  FaultyDisk disk;
  const auto log = Start("/events.db", disk.vfs());
  log->queue().Add(BatchOf(0, "a"));
  AwaitKept(1);
  disk.write_error = SQLITE_FULL;
  log->queue().Add(BatchOf(0, "b"));
  while (log->state().disk != records::Disk::failing) std::this_thread::yield();
  EXPECT_EQ(log->state().waiting, 1U);
  EXPECT_EQ(Fed(), (std::vector<std::string>{"a"})) << "nothing is shown before its commit";
  EXPECT_FALSE(log->state().trouble.empty());
  disk.write_error = 0;
  AwaitKept(2);
  while (log->state().disk != records::Disk::fine) std::this_thread::yield();
  EXPECT_EQ(log->state().newest, 2);
  EXPECT_EQ(Fed(), (std::vector<std::string>{"a", "b"}));
  const auto lines = heard();
  ASSERT_EQ(lines.size(), 2U);
  EXPECT_THAT(lines[0], HasSubstr("devices are not polled for events"));
  EXPECT_THAT(lines[1], HasSubstr("inform: events: events are recorded again"));
}

TEST_F(EventLogTest, ReportsAMissingPlace) {
  const auto log = Start({});
  EXPECT_EQ(log->state().disk, records::Disk::failing);
  EXPECT_FALSE(log->Read({}));
}

TEST_F(EventLogTest, BeginsANewFileAfterARemoval) {
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

TEST_F(EventLogTest, RecordsHowTheGatewayStartedAndEnded) {
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
  EXPECT_EQ(texts[3], "baudgate 2 has started; the previous run was stopped normally");
  const std::string other = (file().parent_path() / "killed.db").string();
  std::filesystem::copy(file(), other);
  std::filesystem::copy(file().string() + "-wal", other + "-wal");
  const auto next = Start(other, {}, {}, true);
  next->queue().Started("4");
  while (next->state().newest < 8) std::this_thread::yield();
  EXPECT_THAT(Texts(*next).back(),
              HasSubstr("4 has started; the previous run ended unexpectedly after"));
}

TEST_F(EventLogTest, AFileFoundDamagedByAReaderIsPutAsideAtTheNextLook) {
  const auto log = Start(file());
  log->queue().Add(BatchOf(0, "a"));
  AwaitKept(1);
  {
    records::Database other(file().string(), records::Database::Mode::write);
    ASSERT_TRUE(other.EmptyLog());
    constexpr int kHeader = 100;
    std::fstream bytes(file(), std::ios::in | std::ios::out | std::ios::binary);
    bytes.seekp(kHeader);
    bytes << std::string(std::filesystem::file_size(file()) - kHeader, 'x');
  }
  EXPECT_FALSE(log->Read({}));
  EXPECT_TRUE(log->state().put_aside.empty());
  for (int ticks = 0; ticks < records::FileWatch::kLookEvery; ++ticks) log->Watch();
  while (log->state().put_aside.empty()) std::this_thread::yield();
  EXPECT_THAT(log->state().put_aside, ElementsAre(file().filename().string() + ".bad"));
  EXPECT_THAT(heard(), Contains(HasSubstr("is damaged (")));
  EXPECT_TRUE(log->Read({})) << "a new one has begun";
  std::filesystem::remove(file().string() + ".bad");
  for (int ticks = 0; ticks < records::FileWatch::kLookEvery; ++ticks) log->Watch();
  while (!log->state().put_aside.empty()) std::this_thread::yield();
}

TEST_F(EventLogTest, RecordsADiskFailure) {
  FaultyDisk disk;
  const auto log = Start("/events.db", disk.vfs(), {}, true);
  log->queue().Add(BatchOf(0, "a"));
  AwaitKept(1);
  disk.write_error = SQLITE_FULL;
  log->queue().Add(BatchOf(0, "b"));
  while (log->state().disk != records::Disk::failing) std::this_thread::yield();
  disk.write_error = 0;
  while (log->state().newest < 3) std::this_thread::yield();
  EXPECT_EQ(log->state().disk, records::Disk::fine);
  EXPECT_EQ(log->state().waiting, 0U);
}

TEST_F(EventLogTest, SharesTheThreadOfTheFileWithTheAudit) {
  const auto writer = std::make_shared<records::EventsWriter>();
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

TEST_F(EventLogTest, ReportsMissingRecordsAgainAfterARestart) {
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
    log->queue().Keep(record);
  }
  const auto log = Start(file());
  log->queue().Add(BatchOf(0, "more"));
  AwaitKept(4);
  EXPECT_THAT(owed(), ElementsAre(1, 1));
  ASSERT_TRUE(log->Read({})->records.at(0).kept);
  EXPECT_EQ(log->Read({})->records.at(0).kept->values.at(0).name, "phases");
}

TEST_F(EventLogTest, AWaitingEventKeepsItsDeviceNameOverAReload) {
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

TEST_F(EventLogTest, TheLastMessageOfADeviceFollowsItsName) {
  {
    const auto log = Start(file());
    log->queue().Add(BatchOf(1, "12.345 E1"));
    AwaitKept(1);
    log->queue().Renumber({{"", ""}, {"", ""}, {"bay-1", "feeder-2"}}, {});
    EXPECT_EQ(log->queue().said(2), "12.345 E1");
    EXPECT_EQ(feed_->Show(2, 0, 7).events.size(), 1U);
    EXPECT_EQ(feed_->Show(1, 0, 7).events.size(), 0U);
    log->queue().Add(BatchOf(2, "12.345 E1", true));
    log->queue().Add(BatchOf(2, "12.346 E2"));
    AwaitKept(3);
    EXPECT_EQ(log->state().repeats, 1U);
  }
  const auto page = ReadPage(file(), {});
  ASSERT_TRUE(page) << page.error();
  EXPECT_EQ(page->records.size(), 2U);
}

TEST_F(EventLogTest, AnEventHasThePriorityOfItsAlarm) {
  {
    const auto log = Start(file());
    EventRecord message;
    message.line = "bay-1";
    message.text = "no alarm";
    log->queue().Tell(message);
    message.text = message.subject = "fault";
    message.mark = {.step = AlarmMark::Step::raise, .priority = config::AlarmPriority::high};
    log->queue().Tell(message);
  }
  const auto texts = [this](config::AlarmPriority priority) {
    std::vector<std::string> found;
    const auto page = ReadPage(file(), {.priority = priority});
    for (const EventRecord& record : page.value().records) {
      EXPECT_EQ(PriorityOf(record), priority);
      found.push_back(record.text);
    }
    return found;
  };
  EXPECT_EQ(texts(config::AlarmPriority::high), std::vector<std::string>{"fault"});
  EXPECT_EQ(texts(config::AlarmPriority::none), std::vector<std::string>{"no alarm"});
  EXPECT_TRUE(texts(config::AlarmPriority::low).empty());
}

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

/// The disk failure is itself an alarm, so alarms must not wait for this disk.
TEST_F(EventLogTest, AlarmsWorkWhileTheDiskFails) {
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
  while (log->state().disk != records::Disk::fine) std::this_thread::yield();
  log->queue().Tell(Raised("next"));
  while (AlarmsIn(heard()).size() < 3) std::this_thread::yield();
  EXPECT_THAT(AlarmsIn(heard()),
              ElementsAre("disk raised active", "disk acknowledged", "next raised active"));
  EXPECT_EQ(log->Alarms().size(), 2U);
}

TEST_F(EventLogTest, AlarmsWorkWhileTheDiskHangs) {
  FaultyDisk disk;
  const auto log = Start("/events.db", disk.vfs());
  log->queue().Add(BatchOf(0, "a"));
  AwaitKept(1);
  disk.Hang(true);
  log->queue().Tell(Raised("first"));
  disk.WaitUntilItHangs();
  for (int ticks = 0; ticks < records::FileWatch::kMostTicks; ++ticks) log->Watch();
  EXPECT_EQ(log->state().disk, records::Disk::fine) << "it may just be slow";
  log->queue().Tell(Raised("second"));
  log->Watch();
  EXPECT_EQ(log->state().disk, records::Disk::stalled);
  EXPECT_EQ(log->state().alarms_active, 2U);
  EXPECT_THAT(
      heard(),
      Contains(HasSubstr("warn: events: the disk does not answer in time (check it with dmesg)")));
  EXPECT_NE(Ack(*log, {.all = true, .by = "user:anna"}).trouble, "") << "nobody waits for it";
  log->Watch();
  disk.Hang(false);
  while (log->state().disk != records::Disk::fine || log->state().waiting > 0)
    std::this_thread::yield();
  log->queue().Tell(Raised("third"));
  while (AlarmsIn(heard()).size() < 5) std::this_thread::yield();
  EXPECT_THAT(AlarmsIn(heard()),
              ElementsAre("first raised active", "second raised active", "first acknowledged",
                          "second acknowledged", "third raised active"))
      << "each once";
}

TEST_F(EventLogTest, AlarmsWorkWithoutAPlaceForTheFile) {
  const auto log = Start({});
  log->queue().Tell(Raised("disk"));
  while (log->Alarms().empty()) std::this_thread::yield();
  while (AlarmsIn(heard()).empty()) std::this_thread::yield();
  EXPECT_THAT(AlarmsIn(heard()), ElementsAre("disk raised active"));
}

TEST_F(EventLogTest, StoresAlarmsAndWhoAcknowledgedThem) {
  const AckQuery of_device{.line = "bay-1", .device = "feeder-1", .by = "user:anna"};
  {
    const auto log = Start(file());
    log->queue().Tell(Raised("a"));
    log->queue().Tell(Raised("b"));
    while (log->state().newest < 2) std::this_thread::yield();
    EXPECT_EQ(log->state().alarms_active, 2U);
    EXPECT_EQ(log->state().alarms_unacknowledged, 2U);
    const Acknowledged one = Ack(*log, {.seqs = {1}, .by = "user:bob"});
    EXPECT_EQ(one.alarms, 1U);
    EXPECT_EQ(one.trouble, "");
    EXPECT_EQ(log->state().newest, 3) << "it is on the disk when it is told";
    EXPECT_EQ(log->state().alarms_unacknowledged, 1U);
    EXPECT_EQ(Texts(*log).back(), "acknowledged by user:bob: a");
    EXPECT_EQ(Ack(*log, {.seqs = {1}}).alarms, 0U);
  }
  const auto log = Start(file());
  EXPECT_EQ(Ack(*log, {.line = "bay-1", .device = "feeder-2"}).alarms, 0U);
  while (log->state().disk != records::Disk::fine) std::this_thread::yield();
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
  records::Database database(file().string(), records::Database::Mode::read);
  EXPECT_EQ(ToText(database.First("SELECT count(*) FROM alarms")), "3") << "in the new file, too";
}

TEST_F(EventLogTest, ARestartEndsUnconfiguredAlarms) {
  {
    const auto log = Start(file());
    log->queue().Tell(Raised("a"));
    log->queue().Tell(Raised("b"));
  }
  watches_ = Only("b");
  const auto log = Start(file());
  while (log->state().newest < 3) std::this_thread::yield();
  EXPECT_EQ(Texts(*log).back(), "the configuration no longer has this alarm: a");
  EXPECT_EQ(log->state().alarms_active, 1U);
  EXPECT_EQ(log->state().alarms_unacknowledged, 2U) << "nobody has seen it yet";
}

TEST_F(EventLogTest, AReloadEndsUnconfiguredAlarms) {
  const auto log = Start(file());
  log->queue().Tell(Raised("a"));
  log->queue().Tell(Raised("b"));
  while (log->state().newest < 2) std::this_thread::yield();
  log->queue().Tell(Raised("c"));
  log->queue().Renumber({{"bay-1", "feeder-1"}}, Only("b"));
  while (log->state().newest < 5) std::this_thread::yield();
  EXPECT_THAT(Texts(*log),
              ElementsAre("a", "b", "c", "the configuration no longer has this alarm: a",
                          "the configuration no longer has this alarm: c"));
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

TEST_F(EventLogTest, ReportsThatAnAcknowledgementWaitsForTheDisk) {
  FaultyDisk disk;
  const auto log = Start("/events.db", disk.vfs());
  log->queue().Tell(Raised("a"));
  while (log->state().newest < 1) std::this_thread::yield();
  disk.write_error = SQLITE_FULL;
  const Acknowledged done = Ack(*log, {.seqs = {1}});
  EXPECT_EQ(done.alarms, 1U);
  EXPECT_THAT(done.trouble, HasSubstr("full"));
  disk.write_error = 0;
  while (log->state().alarms_unacknowledged > 0) std::this_thread::yield();
}

TEST_F(EventLogTest, StoresConsumerPositionsAndReadsOlderEventsFromTheFile) {
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
  std::filesystem::remove(file());
  log->queue().Add(BatchOf(0, "b"));
  AwaitKept(2);
  EXPECT_EQ(take(330).front().record.seq, 492) << "what is in memory";
  EXPECT_EQ(log->state().oldest, 501);
  ASSERT_EQ(log->state().consumers.size(), 1U);
  EXPECT_EQ(log->state().consumers[0].lost, 180);
  cursors_->Set("dds", {501, false});
  for (records::Database database(file().string(), records::Database::Mode::read);;) {
    if (ToText(database.First("SELECT seq FROM event_cursors")) == "501") break;
    std::this_thread::yield();
  }
}

TEST_F(EventLogTest, FeedsTheEndOfTheGatewayOnce) {
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

TEST_F(EventLogTest, EndsWhileTheDiskFails) {
  FaultyDisk disk;
  disk.write_error = SQLITE_FULL;
  const auto log = Start("/events.db", disk.vfs(), {}, true);
  log->queue().Started("1");
  log->queue().End(1h);
  EXPECT_TRUE(Fed().empty());
  disk.write_error = 0;
}

TEST_F(EventLogTest, FeedsGatewayEventsOfADeviceUnderThatDevice) {
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

TEST_F(EventLogTest, FeedsPendingEventsUnderTheDeviceNumberAfterAReload) {
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

TEST_F(EventLogTest, FindsAReturningDeviceByItsName) {
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
