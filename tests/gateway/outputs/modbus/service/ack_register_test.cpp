// The register that acknowledges alarms: whose, which, what the client hears, and the record of it.
// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>

#include "tests/gateway/outputs/modbus/service/service_fixture.h"

namespace baudgate::modbus {
namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;

/// Alarms that are acknowledged when the test says so.
class FakeAlarms final : public events::EventSource {
 public:
  events::EventsState state() const override { return {}; }
  std::vector<events::Alarm> Alarms() const override { return alarms; }
  std::size_t Acknowledge(const events::AckQuery& query,
                          std::function<void(const events::Acknowledged&)> done) override {
    events::Acknowledged told;
    for (const events::Alarm& alarm : alarms) {
      if (!query.Means(alarm)) continue;
      ++told.alarms;
      meant.push_back(alarm.seq);
    }
    by = query.by;
    told.trouble = trouble;
    told.at = WallTime(77s);
    if (told.alarms == 0 || !trouble.empty()) {
      done(told);
    } else {
      waiting = [done = std::move(done), told] { done(told); };
    }
    return told.alarms;
  }
  Result<events::Page> Read(const events::PageQuery&) const override { return events::Page{}; }
  Result<events::PastPage> ReadPast(const events::PastQuery&) const override {
    return events::PastPage();
  }

  void Raise(const std::string& device, std::int64_t seq) {
    events::Alarm& alarm = alarms.emplace_back();
    alarm.line = "l";
    alarm.device = device;
    alarm.seq = seq;
    alarm.state = events::AlarmState::active;
  }

  std::vector<events::Alarm> alarms;
  std::vector<std::int64_t> meant;
  std::string by;
  std::string trouble;
  std::function<void()> waiting;
};

class KeptNotes final : public audit::WriteLog {
 public:
  std::optional<audit::Ticket> Begin(audit::WriteRecord) override { return {}; }
  void End(audit::Ticket, const audit::Ending&) override {}
  Written WaitFor(audit::Ticket, Instant) override { return Written::yes; }
  void Note(audit::WriteRecord record, Instant) override { notes.push_back(std::move(record)); }
  std::string Trouble() const override { return {}; }

  std::vector<audit::WriteRecord> notes;
};

class AckServiceTest : public ServiceTest {
 protected:
  AckServiceTest() {
    config_.lines[0].name = "l";
    config_.lines[0].devices.push_back(MakeDevice(2, {}));
    config_.lines[0].devices[0].name = "d1";
    config_.lines[0].devices[1].name = "d2";
    links_.alarms = &alarms_;
    links_.writes = &log_;
    alarms_.Raise("d1", 7);
    alarms_.Raise("d1", 9);
    alarms_.Raise("d2", 8);
    alarms_.Raise("d2", (std::int64_t{3} << 32) + 5);
  }
  /// What the client hears, at once or when the disk has it.
  std::string Write(std::uint8_t unit, const std::string& number) {
    alarms_.meant.clear();
    auto answers = Ask(unit, "10 23 88 00 02 04 " + number);
    if (answers.empty() && alarms_.waiting) {
      std::exchange(alarms_.waiting, nullptr)();
      answers = Settle();
    }
    return answers.size() == 1 ? answers[0].substr(18) : "?";
  }

  FakeAlarms alarms_;
  KeptNotes log_;
};

TEST_F(AckServiceTest, AcknowledgesTheAlarmOfTheNumber) {
  EXPECT_THAT(Ask(1, "10 23 88 00 02 04 00 00 00 07"), IsEmpty()) << "it is not on the disk yet";
  EXPECT_THAT(alarms_.meant, ElementsAre(7));
  EXPECT_EQ(alarms_.by, "modbus 10.0.0.7:40112");
  EXPECT_THAT(log_.notes, IsEmpty());
  alarms_.waiting();
  EXPECT_THAT(Settle(), ElementsAre("12 34 00 00 00 06 01 10 23 88 00 02"));
  ASSERT_EQ(log_.notes.size(), 1U);
  const audit::WriteRecord& note = log_.notes[0];
  EXPECT_EQ(note.client, "10.0.0.7:40112");
  EXPECT_EQ(note.line + "." + note.device + "." + note.point, "l.d1.alarms");
  EXPECT_EQ(note.value, Value(std::int64_t{7}));
  EXPECT_EQ(note.end, WriteEnd::ok);
  EXPECT_EQ(note.time, WallTime(77s));
}

TEST_F(AckServiceTest, OfAUnitItsOwnAndOfTheGatewayAll) {
  EXPECT_EQ(Write(1, "00 00 00 08"), "01 90 03") << "another unit's";
  EXPECT_THAT(alarms_.meant, IsEmpty());
  EXPECT_EQ(Write(255, "00 00 00 08"), "FF 10 23 88 00 02");
  EXPECT_THAT(alarms_.meant, ElementsAre(8));
  EXPECT_EQ(Write(2, "00 00 00 05"), "02 10 23 88 00 02") << "by its low 32 bits";
  EXPECT_EQ(Write(2, "FF FF FF FF"), "02 10 23 88 00 02");
  EXPECT_EQ(alarms_.meant.size(), 2U);
  EXPECT_EQ(Write(255, "FF FF FF FF"), "FF 10 23 88 00 02");
  EXPECT_EQ(alarms_.meant.size(), 4U);
  EXPECT_EQ(log_.notes.back().value, Value(std::string("all")));
  EXPECT_EQ(log_.notes.back().device, "");
}

TEST_F(AckServiceTest, RefusesWhatNamesNone) {
  EXPECT_EQ(Write(1, "00 00 00 63"), "01 90 03");
  EXPECT_EQ(Write(1, "00 00 00 00"), "01 90 03");
  EXPECT_THAT(Ask(1, "10 23 88 00 01 02 00 07"), ElementsAre("12 34 00 00 00 03 01 90 03"))
      << "half";
  EXPECT_THAT(Ask(1, "06 23 89 00 07"), ElementsAre("12 34 00 00 00 03 01 86 03")) << "half";
  EXPECT_THAT(Ask(1, "10 23 88 00 03 06 00 00 00 07 00 00"),
              ElementsAre("12 34 00 00 00 03 01 90 02"));
  EXPECT_THAT(Ask(1, "03 23 88 00 02"), ElementsAre("12 34 00 00 00 03 01 83 02")) << "to be read";
  EXPECT_THAT(log_.notes, IsEmpty());
  alarms_.alarms.clear();
  EXPECT_EQ(Write(1, "FF FF FF FF"), "01 10 23 88 00 02") << "all of none";
}

TEST_F(AckServiceTest, IsDeniedWhereTheListenerOnlyReads) {
  listener().permit = config::Permit::read;
  EXPECT_EQ(Write(1, "00 00 00 07"), "01 90 01");
  EXPECT_EQ(Write(255, "00 00 00 07"), "FF 90 01") << "alarms of the gateway";
  EXPECT_THAT(alarms_.meant, IsEmpty());
  ASSERT_EQ(log_.notes.size(), 2U);
  for (const auto& note : log_.notes) {
    EXPECT_EQ(note.kind, audit::Kind::denied);
    EXPECT_EQ(note.end, WriteEnd::denied);
    EXPECT_FALSE(note.reason.empty());
  }
}

TEST_F(AckServiceTest, SaysThatTheDiskFails) {
  alarms_.trouble = "the disk is full";
  EXPECT_EQ(Write(1, "00 00 00 07"), "01 90 0B");
  EXPECT_EQ(log_.notes[0].end, WriteEnd::unknown);
  EXPECT_EQ(log_.notes[0].reason, "the disk is full");
}

TEST_F(AckServiceTest, IsNotThereWithoutEvents) {
  links_.alarms = nullptr;
  EXPECT_EQ(Write(1, "00 00 00 07"), "01 90 02");
}

}  // namespace
}  // namespace baudgate::modbus
