// The power is cut at a random moment, hundreds of times: the alarms in the file are those that the
// events in the file make, no more and no less, and nothing that was kept is lost.
// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>
#include <sqlite3.h>

#include <map>
#include <random>
#include <utility>

#include "gateway/records/events/event_file.h"
#include "gateway/records/events/event_source.h"
#include "tests/gateway/records/audit/faulty_disk.h"
#include "tests/support/long_run.h"

namespace baudgate::events {
namespace {

using audit::FaultyDisk;
using Step = AlarmMark::Step;

const std::size_t kSeeds = LongRun(300);
constexpr int kLives = 4;
constexpr Step kSteps[] = {Step::raise, Step::clear, Step::pulse, Step::acknowledge};

/// Its text says what it does, for the oracle: "2 of 4", what to which alarm.
EventRecord Event(std::mt19937& random) {
  EventRecord event;
  event.line = "bay";
  event.device = "relay";
  event.subject = std::to_string(random() % 5);
  const auto step = random() % 4;
  event.text = std::to_string(step) + " of " + event.subject;
  event.mark.step = kSteps[step];
  event.mark.first = kSteps[step] != Step::acknowledge && random() % 8 == 0;
  return event;
}

class Life {
 public:
  Life(FaultyDisk& disk, std::mt19937& random)
      : disk_(disk), random_(random), file_(audit::kEventsFile, disk.vfs()) {}

  /// Until the power fails. The last number that was kept.
  std::int64_t Run() {
    disk_.power_left = static_cast<int>(1 + random_() % 250);
    while (!disk_.power_failed()) {
      for (auto count = random_() % 4; count > 0; --count) Add();
      Write();
      // A moment of trouble that passes.
      disk_.write_error = random_() % 50 == 0 ? SQLITE_FULL : 0;
      disk_.sync_error = random_() % 50 == 0 ? SQLITE_IOERR_FSYNC : 0;
    }
    disk_.write_error = disk_.sync_error = 0;
    return book_.newest();
  }

 private:
  void Add() {
    if (random_() % 2 == 0) return book_.TellAlways(Event(random_));
    book_.Add(
        {0, std::to_string(random_() % 3), random_() % 2 == 0, {Event(random_), Event(random_)}});
  }
  void Write() {
    if (const auto opened = file_.Open()) {
      if (!opened->ok) return;
      book_.OnOpened(opened->contents.last, opened->contents.said, opened->contents.alarms);
    }
    const auto due = book_.Prepare();
    if (file_.Write(due)) book_.Kept(due.size());
  }

  FaultyDisk& disk_;
  std::mt19937& random_;
  EventBook book_;
  EventFile file_;
};

/// State and number of each alarm, as the events say.
using States = std::map<std::string, std::pair<AlarmState, std::int64_t>>;
States Follow(const std::vector<EventRecord>& events) {
  States states;
  for (const EventRecord& event : events) {
    const std::string name = event.text.substr(event.text.size() - 1);
    auto& [state, seq] = states[name];
    const Step step = kSteps[event.text[0] - '0'];
    const bool active = IsActive(state);
    if (step == Step::raise && state != AlarmState::active) {
      state = AlarmState::active;
      seq = event.seq;
    } else if (step == Step::pulse && !active) {
      state = AlarmState::returned;
      seq = event.seq;
    } else if (step == Step::clear && active) {
      state = state == AlarmState::active ? AlarmState::returned : AlarmState::normal;
    } else if (step == Step::acknowledge) {
      EXPECT_TRUE(IsUnacknowledged(state)) << "acknowledged twice: event " << event.seq;
      state = active ? AlarmState::acknowledged : AlarmState::normal;
    }
  }
  std::erase_if(states, [](const auto& one) { return one.second.first == AlarmState::normal; });
  return states;
}

std::vector<EventRecord> ReadAll(const std::string& vfs) {
  Database database(audit::kEventsFile, Database::Mode::read, vfs);
  std::vector<EventRecord> all;
  PageQuery query;
  for (bool more = true; more;) {
    auto page = ReadPage(database, query);
    if (!page) {
      ADD_FAILURE() << page.error();
      break;
    }
    all.insert(all.end(), page->records.begin(), page->records.end());
    query.after = page->next;
    more = page->more;
  }
  return all;
}

TEST(AlarmCut, LeavesAlarmsThatFitTheirEvents) {
  std::size_t events = 0;
  std::size_t alarms = 0;
  for (unsigned seed = 1; seed <= kSeeds && !testing::Test::HasFailure(); ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    std::mt19937 random(seed);
    FaultyDisk disk;
    for (int life = 0; life < kLives; ++life) {
      const std::int64_t kept = Life(disk, random).Run();
      disk.Restore(random);
      EventFile file(audit::kEventsFile, disk.vfs());
      const auto opened = file.Open();
      ASSERT_TRUE(opened && opened->ok) << opened->error;
      EXPECT_TRUE(opened->put_aside.empty()) << opened->put_aside;
      EXPECT_GE(opened->contents.last, kept);
      const auto records = ReadAll(disk.vfs());
      States states;
      for (const Alarm& alarm : opened->contents.alarms) {
        states[alarm.name] = {alarm.state, alarm.seq};
      }
      EXPECT_EQ(states, Follow(records));
      events += records.size();
      alarms += states.size();
    }
  }
  EXPECT_GT(events, 20U * kSeeds) << "there was something to be lost";
  EXPECT_GT(alarms, 1U * kSeeds);
}

}  // namespace
}  // namespace baudgate::events
