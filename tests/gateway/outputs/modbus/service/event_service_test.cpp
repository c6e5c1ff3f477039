// Tests of the event registers. Each client has a separate position in the events of each unit.
// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>

#include "tests/gateway/outputs/modbus/service/service_fixture.h"

namespace baudgate::modbus {
namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;

class EventsOfService : public ServiceTest {
 protected:
  EventsOfService() {
    config_.lines[0].devices.push_back(MakeDevice(2, {}));
    feed_->Renumber({{"", "0"}, {"", "1"}});
    links_.events = feed_;
  }
  void Happens(events::Source source, std::size_t count = 1) {
    events::EventRecord record;
    record.device = std::to_string(source);
    for (; count > 0; --count) {
      record.seq = ++seq_;
      record.code = static_cast<std::uint32_t>(seq_);
      feed_->Add({record});
    }
  }
  struct Block {
    std::uint64_t first = 0, newest = 0, oldest = 0, lost = 0;
    std::vector<std::uint64_t> numbers;
  };
  Block Read(std::uint8_t unit) {
    const Answers answers = Ask(unit, "03 23 38 00 50");
    EXPECT_EQ(answers.size(), 1U);
    const Bytes frame = ParseHex(answers.at(0)).value_or(Bytes());
    EXPECT_EQ(frame.size(), 9U + 160U) << answers.at(0);
    const ByteReader bytes(frame);
    const auto u32 = [&](std::size_t at) { return bytes.U32Be(9 + 2 * at).value_or(0); };
    Block block{u32(0), u32(2), u32(4), u32(6), {}};
    const std::size_t count = bytes.U16Be(9 + 2 * 8).value_or(0);
    for (std::size_t i = 0; i < count; ++i) {
      block.numbers.push_back(u32(10 + 10 * i));
      EXPECT_EQ(u32(10 + 10 * i + 7), block.numbers.back()) << "half of another event";
    }
    return block;
  }
  void Want(std::uint8_t unit, std::uint32_t first) {
    const std::string answer = "12 34 00 00 00 06 " + Hex(unit) + " 10 23 38 00 02";
    EXPECT_THAT(Ask(unit, "10 23 38 00 02 04 " + Hex(first >> 24) + " " + Hex(first >> 16) + " " +
                              Hex(first >> 8) + " " + Hex(first)),
                ElementsAre(answer));
  }
  static std::string Hex(std::uint32_t byte) {
    const std::uint8_t low[] = {static_cast<std::uint8_t>(byte)};
    return ToHex(low);
  }

  std::shared_ptr<events::EventFeed> feed_ =
      std::make_shared<events::EventFeed>(events::FeedLimits{.events = 20, .remembered = 20});
  std::int64_t seq_ = 0;
};

TEST_F(EventsOfService, AreEmptyWithoutAnEventsFile) {
  links_.events = nullptr;
  const Block block = Read(1);
  EXPECT_EQ(block.newest, 0U);
  EXPECT_THAT(block.numbers, IsEmpty());
}

TEST_F(EventsOfService, ShowTheNewestEventsOfTheUnit) {
  Happens(0, 3);
  Happens(1, 2);
  EXPECT_THAT(Read(1).numbers, ElementsAre(1, 2, 3));
  EXPECT_THAT(Read(2).numbers, ElementsAre(4, 5));
  EXPECT_THAT(Read(255).numbers, ElementsAre(1, 2, 3, 4, 5));
  EXPECT_THAT(Read(0).numbers, ElementsAre(1, 2, 3, 4, 5));
  EXPECT_EQ(Read(1).newest, 5U) << "of the whole gateway";
}

TEST_F(EventsOfService, EachConnectionHasAReadPositionPerUnit) {
  Happens(0, 3);
  Want(1, 2);
  EXPECT_THAT(Read(1).numbers, ElementsAre(2, 3));
  EXPECT_EQ(Read(1).first, 2U);
  EXPECT_THAT(Read(255).numbers, ElementsAre(1, 2, 3)) << "another unit";
  Want(255, 3);
  EXPECT_THAT(Read(255).numbers, ElementsAre(3));
  KeptWire other;
  const auto service = Enter(other);
  service->Handle(Frame(1, "03 23 38 00 0A"), Clocks());
  EXPECT_THAT(other.Take(), ElementsAre("12 34 00 00 00 17 01 03 14 00 00 00 00 00 00 00 03 00 00 "
                                        "00 01 00 00 00 00 00 03 00 00"))
      << "another connection";
  Want(1, 0);
  EXPECT_THAT(Read(1).numbers, ElementsAre(1, 2, 3));
}

TEST_F(EventsOfService, UnitZeroRefusesEventWrites) {
  Happens(0, 3);
  EXPECT_THAT(Ask(0, "10 23 38 00 02 04 00 00 00 02"), ElementsAre("12 34 00 00 00 03 00 90 02"));
  EXPECT_THAT(Ask(0, "06 23 38 00 02"), ElementsAre("12 34 00 00 00 03 00 86 02"));
  EXPECT_THAT(Ask(0, "10 23 88 00 02 04 FF FF FF FF"), ElementsAre("12 34 00 00 00 03 00 90 02"))
      << "alarms are acknowledged at 255";
  EXPECT_EQ(Read(0).first, 0U);
  EXPECT_THAT(Read(0).numbers, ElementsAre(1, 2, 3));
  EXPECT_THAT(Ask(0, "10 23 38 00 02 03 00 00 00"), ElementsAre("12 34 00 00 00 03 00 90 03"));
  listener().broadcast = config::Listener::Broadcast::pass;
  EXPECT_THAT(Ask(0, "10 23 38 00 02 04 00 00 00 02"), ElementsAre("nothing"));
  EXPECT_EQ(Read(0).first, 0U);
}

TEST_F(EventsOfService, AReadPositionEndsWithItsConnection) {
  Happens(0, 3);
  Want(1, 3);
  services_[0]->Close();
  services_.clear();
  EXPECT_THAT(Read(1).numbers, ElementsAre(1, 2, 3));
}

TEST_F(EventsOfService, SettingTheReadPositionNeedsNoWritePermission) {
  config_.lines[0].devices[0].points[0].writing.allowed = false;
  Happens(0, 3);
  Want(1, 2);
  listener().permit = config::Permit::read;
  EXPECT_THAT(Ask(1, "10 23 38 00 02 04 00 00 00 01"), ElementsAre("12 34 00 00 00 03 01 90 01"));
  EXPECT_THAT(sink_.denied, IsEmpty());
  EXPECT_THAT(Read(1).numbers, ElementsAre(2, 3));
}

TEST_F(EventsOfService, RefuseOtherWrites) {
  const struct {
    const char* pdu;
    const char* answer;
  } cases[] = {
      {"06 23 38 00 01", "86 03"},
      {"06 23 39 00 01", "86 03"},
      {"10 23 38 00 01 02 00 01", "90 03"},
      {"10 23 38 00 03 06 00 00 00 01 00 00", "90 02"},
      {"10 23 37 00 02 04 00 00 00 01", "90 02"},
      {"10 23 39 00 02 04 00 00 00 01", "90 02"},
      {"06 23 3A 00 01", "86 02"},
      {"06 23 87 00 01", "86 02"},
      {"05 23 38 FF 00", "85 02"},
      {"0F 23 38 00 02 01 03", "8F 02"},
  };
  for (const auto& c : cases) {
    EXPECT_THAT(Ask(1, c.pdu), ElementsAre("12 34 00 00 00 03 01 " + std::string(c.answer)))
        << c.pdu;
  }
  EXPECT_EQ(Read(1).first, 0U);
}

TEST_F(EventsOfService, AreReadInWholeValues) {
  Happens(0, 3);
  EXPECT_THAT(Ask(1, "04 23 40 00 01"), ElementsAre("12 34 00 00 00 05 01 04 02 00 03"));
  EXPECT_THAT(Ask(1, "04 23 3A 00 04"),
              ElementsAre("12 34 00 00 00 0B 01 04 08 00 00 00 03 00 00 00 01"));
  EXPECT_THAT(Ask(1, "04 23 4C 00 02"), ElementsAre("12 34 00 00 00 07 01 04 04 00 00 00 02"));
  EXPECT_THAT(Ask(1, "04 23 38 00 01"), ElementsAre("12 34 00 00 00 03 01 84 03"));
  EXPECT_THAT(Ask(1, "01 23 38 00 01"), ElementsAre("12 34 00 00 00 03 01 81 02"));
}

TEST_F(EventsOfService, EachOverwrittenEventIsCountedAsLost) {
  std::uint64_t next = 1;
  std::uint64_t seen = 0;
  std::uint64_t lost = 0;
  std::uint64_t happened = 0;
  for (unsigned round = 0; round < 200; ++round) {
    const std::size_t own = round % 13;
    const std::size_t others = round * 7 % 9;
    Happens(0, own / 2);
    Happens(1, others);
    Happens(0, own - own / 2);
    happened += own;
    Want(1, static_cast<std::uint32_t>(next));
    const Block block = Read(1);
    EXPECT_EQ(block.first, next);
    EXPECT_EQ(block.newest, static_cast<std::uint64_t>(seq_));
    EXPECT_EQ(block.oldest, seq_ <= 20 ? (seq_ == 0 ? 0U : 1U) : block.newest - 19);
    lost += block.lost;
    seen += block.numbers.size();
    next = block.numbers.size() == 7 ? block.numbers.back() + 1 : block.newest + 1;
  }
  while (true) {
    Want(1, static_cast<std::uint32_t>(next));
    const Block block = Read(1);
    lost += block.lost;
    seen += block.numbers.size();
    if (block.numbers.empty()) break;
    next = block.numbers.back() + 1;
  }
  EXPECT_EQ(seen + lost, happened);
  EXPECT_GT(lost, 0U) << "the ring was too long for this test";
  EXPECT_GT(seen, 500U);
}

TEST_F(EventsOfService, EventsOfOtherUnitsAreSkippedAndNotCountedAsLost) {
  Happens(0, 2);
  Happens(1, 30);
  Happens(0, 1);
  Want(1, 3);
  const Block block = Read(1);
  EXPECT_EQ(block.oldest, 14U);
  EXPECT_EQ(block.lost, 0U);
  EXPECT_THAT(block.numbers, ElementsAre(33));
  Want(1, 1);
  EXPECT_EQ(Read(1).lost, 2U);
  Want(255, 3);
  EXPECT_EQ(Read(255).lost, 11U);
}

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

TEST_F(AckServiceTest, AcknowledgesTheAlarmWithTheWrittenNumber) {
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

TEST_F(AckServiceTest, AUnitAcknowledgesItsOwnAlarmsAndTheGatewayAll) {
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

TEST_F(AckServiceTest, RefusesNumbersWithoutAnAlarm) {
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

TEST_F(AckServiceTest, AReadOnlyListenerDeniesAcknowledgements) {
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

TEST_F(AckServiceTest, AFailingDiskIsAnsweredWithAnException) {
  alarms_.trouble = "the disk is full";
  EXPECT_EQ(Write(1, "00 00 00 07"), "01 90 0B");
  EXPECT_EQ(log_.notes[0].end, WriteEnd::unknown);
  EXPECT_EQ(log_.notes[0].reason, "the disk is full");
}

TEST_F(AckServiceTest, RefusesAcknowledgementsWithoutAnEventsFile) {
  links_.alarms = nullptr;
  EXPECT_EQ(Write(1, "00 00 00 07"), "01 90 02");
}

}  // namespace
}  // namespace baudgate::modbus
