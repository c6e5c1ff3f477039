// Tests that the data that a relay records of a trip is stored completely with the event of this
// trip, in spite of faults. The registers of the relays contain the number of their latest trip.
// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <charconv>
#include <map>
#include <random>

#include "config/catalog/option_values.h"
#include "gateway/base/text.h"
#include "gateway/bus/poller/poller.h"
#include "gateway/records/events/record_service.h"
#include "protocols/reader/codec.h"
#include "protocols/reader/protocol.h"
#include "tests/protocols/runs/event_keeper.h"
#include "tests/protocols/runs/mishaps.h"
#include "tests/protocols/runs/rig.h"
#include "tests/support/long_run.h"
#include "tests/support/virtual_line.h"

namespace baudgate::protocols {
namespace {

using events::KeptRecord;
using events::RecordState;

constexpr std::uint32_t kTripped = 3;

/// True for the points of a record: V6 and V11…V58.
bool IsOfRecord(const config::Point& point) {
  return point.name == "trip_phases" || point.name.starts_with("record");
}

void WithRecords(config::Line& line) {
  for (config::Device& device : line.devices) {
    device.events = true;
    config::Record trip{"trip", {}};
    for (std::uint32_t i = 0; i < device.points.size(); ++i) {
      if (IsOfRecord(device.points[i])) trip.points.push_back(i);
    }
    device.records = {trip};
  }
}

class TripStation {
 public:
  TripStation(unsigned seed, Troubles troubles)
      : mishaps_(seed, troubles),
        rig_(RealLine("Spa9600"), WithRecords),
        keeper_({rig_.device(0).name, rig_.device(1).name}) {
    rig_->keep_sent = false;
    rig_->keep = [this](const bus::ReportedEvents& reported) {
      const bool kept = keeper_.Keep(reported, rig_.device(reported.device));
      if (kept) service_->Owe(keeper_.TakeOwed());
      return kept;
    };
    rig_->drained = [this](std::uint32_t device, Instant asked) {
      service_->OnDrained(device, asked);
    };
    rig_->read = [this](std::uint32_t device, Instant at) { service_->OnRead(device, at); };
    rig_->always = [this] { Work(); };
    for (std::uint32_t i = 0; i < rig_.devices(); ++i) SpoilWire(rig_->twin(i).manner);
    Begin();
    rig_->Open();
  }

  void RunFor(Duration time) {
    const Duration until = rig_->elapsed() + time;
    while (rig_->elapsed() < until) {
      rig_->RunFor(
          std::chrono::milliseconds(1 + mishaps_.Below(mishaps_.Below(4) == 0 ? 500 : 20'000)));
      Trip();
      if (keeper_.power_failed() || mishaps_.Kills(10)) Restart();
    }
  }

  void End() {
    mishaps_.End();
    Restart();
    rig_->RunFor(5min);
  }

  void Check() {
    std::map<std::int64_t, KeptRecord> records;
    for (KeptRecord& record : keeper_.ReadRecords()) {
      const auto event = record.event;
      ASSERT_TRUE(records.emplace(event, std::move(record)).second) << "kept twice";
    }
    for (const events::EventRecord& event : keeper_.ReadAll()) {
      const auto found = records.find(event.seq);
      ASSERT_NE(found, records.end()) << "event " << event.seq << " has none";
      CheckRecord(event.text.substr(event.text.rfind(' ') + 1), found->second);
    }
    EXPECT_TRUE(keeper_.TakeOwed().empty());
  }

  std::size_t read = 0;
  std::size_t superseded = 0;
  std::size_t not_read = 0;
  std::size_t restarts = 0;

 private:
  void CheckRecord(const std::string& number, const KeptRecord& record) {
    read += record.state == RecordState::read ? 1U : 0U;
    superseded += record.state == RecordState::superseded ? 1U : 0U;
    not_read += record.state == RecordState::not_read ? 1U : 0U;
    if (record.state != RecordState::read) {
      ASSERT_TRUE(record.values.empty());
      ASSERT_NE(record.text, "");
      return;
    }
    ASSERT_EQ(record.values.size(), 41U);
    for (const events::RecordValue& value : record.values) {
      ASSERT_TRUE(IsGood(value.quality)) << Name(value.quality);
      ASSERT_EQ(ToText(value.value), number) << value.name << " of another trip";
    }
  }

  void SpoilWire(Manner& manner) {
    manner.distort = [this](Bytes reply) { return mishaps_.Carry(std::move(reply)); };
  }

  void Trip() {
    const auto device = mishaps_.Below(rig_.devices());
    const std::string number = std::to_string(++serial_);
    ASSERT_TRUE(rig_->twin(device).twin->Raise({0, kTripped, {}, number}, rig_->now()));
    const auto& points = rig_.device(device).points;
    for (std::size_t i = 0; i < points.size(); ++i) {
      if (!IsOfRecord(points[i])) continue;
      const bool whole = points[i].type == config::Type::uint16;
      rig_->twin(device).values.Set(
          i, whole ? Value(std::int64_t{serial_}) : Value(static_cast<double>(serial_)));
    }
  }

  void Work() {
    for (bus::WriteCommand& command : std::exchange(asked_, {})) {
      const std::uint32_t device = command.device;
      if (!rig_->Submit(std::move(command))) ADD_FAILURE() << "device " << device;
    }
    std::erase_if(kept_, [this](const KeptRecord& record) { return keeper_.Keep(record); });
  }

  void Begin() {
    keeper_.Begin(mishaps_.PowerLeft(600));
    asked_.clear();
    kept_.clear();
    const std::size_t generation = restarts;
    services_.push_back(std::make_unique<events::RecordService>(
        rig_->store(),
        events::RecordService::Ends{.clocks = [this] { return rig_->now(); },
                                    .ask =
                                        [this, generation](bus::WriteCommand command) {
                                          if (generation != restarts) return false;
                                          asked_.push_back(std::move(command));
                                          return true;
                                        },
                                    .keep =
                                        [this, generation](KeptRecord record) {
                                          if (generation == restarts)
                                            kept_.push_back(std::move(record));
                                        }}));
    service_ = services_.back().get();
    for (std::uint32_t line = 0; line < rig_->config().lines.size(); ++line) {
      service_->Add(rig_->store().LineAt(line));
    }
    service_->Start();
    service_->Owe(keeper_.TakeOwed());
  }
  void Restart() {
    ++restarts;
    keeper_.End(mishaps_.random());
    Begin();
    rig_->Restart();
  }

  Mishaps mishaps_;
  Rig rig_;
  EventKeeper keeper_;
  std::vector<std::unique_ptr<events::RecordService>> services_;
  events::RecordService* service_ = nullptr;
  std::vector<bus::WriteCommand> asked_;
  std::vector<KeptRecord> kept_;
  std::uint32_t serial_ = 0;
};

TEST(TripRecords, AreStoredWithTheirTripsOverAGoodLine) {
  TripStation station(1, {});
  station.RunFor(15min);
  station.End();
  station.Check();
  EXPECT_GT(station.read, 25U);
  EXPECT_GT(station.superseded, 5U);
  EXPECT_EQ(station.not_read, 0U);
}

TEST(TripRecords, AreNeverMixedUpOverABadLineKillsAndPowerCuts) {
  const std::size_t seeds = LongRun(6);
  std::size_t read = 0;
  std::size_t restarts = 0;
  for (unsigned seed = 1; seed <= seeds && !::testing::Test::HasFailure(); ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    TripStation station(seed,
                        {.wire_one_in = 30, .kills = seed % 2 != 0, .power_cuts = seed % 3 == 1});
    station.RunFor(10min);
    station.End();
    station.Check();
    read += station.read;
    restarts += station.restarts;
  }
  EXPECT_GT(read, 10 * seeds);
  EXPECT_GT(restarts, 2 * seeds);
}

// ---------------- The answer that a reader sends after a tag is stored with this tag, and never
// with another tag.

const std::string kNoTag = "0000000000";

config::Line GateLine() {
  config::Device device;
  device.name = "gate";
  device.address = "1";
  device.protocol = "reader";
  device.options = config::DefaultOptions(ReaderProtocol());
  device.options.Set("commands", std::string("ask"));
  device.never_old = true;
  device.events = true;
  for (const char* read : {"message", "present"}) {
    config::Point point;
    point.name = point.read = read;
    point.group = config::Group::daily;
    const bool text = std::string_view(read) == "message";
    point.type = text ? config::Type::string : config::Type::boolean;
    point.text_length = text ? 10 : 0;
    device.points.push_back(point);
  }
  device.records = {{"transponder", {0, 1}}};
  config::EventText& tag = device.event_texts.emplace_back();
  tag.code = 1;
  tag.text = "tag";
  tag.record = "transponder";
  config::Line line;
  line.name = "line";
  line.protocol = "reader";
  line.serial = ReaderProtocol().serial;
  line.devices = {std::move(device)};
  return line;
}

class Gate {
 public:
  explicit Gate(unsigned seed) : random_(seed), line_(GateLine(), {&ReaderProtocol()}) {
    line_.keep = [this](const bus::ReportedEvents& reported) {
      const bool kept = keeper_.Keep(reported, line_.config().lines[0].devices[0]);
      if (kept) service_->Owe(keeper_.TakeOwed());
      return kept;
    };
    line_.drained = [this](std::uint32_t device, Instant asked) {
      service_->OnDrained(device, asked);
    };
    line_.read = [this](std::uint32_t device, Instant at) { service_->OnRead(device, at); };
    line_.always = [this] { Work(); };
    line_.twin(0).manner.instead = [this](View request) -> std::optional<Bytes> {
      if (request[0] != 'r') return std::nullopt;
      return protocols::reader::EncodeTag(there_);
    };
    Begin();
    line_.Open();
  }

  void Pass(const std::string& tag, Duration stays) {
    line_.Inject(protocols::reader::EncodeTag(tag));
    there_ = tag;
    line_.RunFor(stays);
    there_ = kNoTag;
  }
  void RunFor(Duration time) { line_.RunFor(time); }
  void Restart() {
    ++restarts_;
    keeper_.End(random_);
    Begin();
    line_.Restart();
  }
  void LosePort(Duration time) {
    line_.Close();
    line_.RunFor(time);
    line_.Open();
  }

  struct Kept {
    std::string tag;
    KeptRecord record;
  };
  std::vector<Kept> ReadAll() {
    std::map<std::int64_t, KeptRecord> records;
    for (KeptRecord& record : keeper_.ReadRecords()) {
      EXPECT_TRUE(records.emplace(record.event, record).second) << "kept twice";
    }
    std::vector<Kept> all;
    for (const events::EventRecord& event : keeper_.ReadAll()) {
      EXPECT_TRUE(records.contains(event.seq)) << "event " << event.seq << " has none";
      all.push_back({event.text.substr(5), records[event.seq]});
    }
    return all;
  }

  std::mt19937 random_;

 private:
  void Work() {
    for (bus::WriteCommand& command : std::exchange(asked_, {})) line_.Submit(std::move(command));
    std::erase_if(kept_, [this](const KeptRecord& record) { return keeper_.Keep(record); });
  }
  void Begin() {
    keeper_.Begin(-1);
    asked_.clear();
    kept_.clear();
    const auto alive = [this, generation = restarts_] { return generation == restarts_; };
    events::RecordService::Ends ends;
    ends.clocks = [this] { return line_.now(); };
    ends.ask = [this, alive](bus::WriteCommand command) {
      if (!alive()) return false;
      asked_.push_back(std::move(command));
      return true;
    };
    ends.keep = [this, alive](KeptRecord record) {
      if (alive()) kept_.push_back(std::move(record));
    };
    services_.push_back(std::make_unique<events::RecordService>(line_.store(), std::move(ends)));
    service_ = services_.back().get();
    service_->Add(line_.store().LineAt(0));
    service_->Start();
    service_->Owe(keeper_.TakeOwed());
  }

  VirtualLine line_;
  EventKeeper keeper_{{"gate"}};
  std::vector<std::unique_ptr<events::RecordService>> services_;
  events::RecordService* service_ = nullptr;
  std::vector<bus::WriteCommand> asked_;
  std::vector<KeptRecord> kept_;
  std::string there_ = kNoTag;
  int restarts_ = 0;
};

TEST(ReaderRecords, AreStoredTogetherWithTheirTag) {
  Gate gate(1);
  gate.RunFor(5s);
  gate.Pass("0000000001", 5s);
  gate.RunFor(10s);
  gate.Pass("0000000002", 1ms);
  gate.RunFor(10s);
  const auto all = gate.ReadAll();
  ASSERT_EQ(all.size(), 2U);
  for (const auto& [tag, record] : all) {
    EXPECT_EQ(record.state, RecordState::read) << record.text;
    EXPECT_EQ(record.name, "transponder");
    ASSERT_EQ(record.values.size(), 2U);
    EXPECT_TRUE(IsGood(record.values[0].quality));
    EXPECT_EQ(ToText(record.values[1].value), tag == "0000000001" ? "1" : "0");
    EXPECT_LT(record.read - record.device_time, 200ms);
  }
  EXPECT_EQ(ToText(all[0].record.values[0].value), "0000000001");
  EXPECT_EQ(ToText(all[1].record.values[0].value), kNoTag);
}

TEST(ReaderRecords, AreNeverMixedUp) {
  const std::size_t seeds = LongRun(6);
  std::size_t read = 0;
  std::size_t superseded = 0;
  for (unsigned seed = 1; seed <= seeds && !::testing::Test::HasFailure(); ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    Gate gate(seed);
    constexpr int kTags = 150;
    for (int tag = 1; tag <= kTags; ++tag) {
      auto& random = gate.random_;
      gate.RunFor(std::chrono::milliseconds(random() % (random() % 3 == 0 ? 60 : 4000)));
      gate.Pass(fmt::format("{:010X}", tag),
                std::chrono::milliseconds(17 + random() % (random() % 2 == 0 ? 100 : 3000)));
      if (seed % 2 != 0 && tag % 10 == 0) gate.Restart();
      if (seed % 3 == 1 && tag % 8 == 0) gate.LosePort(1s * (random() % 30));
    }
    gate.RunFor(5min);
    gate.Pass(fmt::format("{:010X}", kTags + 1), 5s);
    gate.RunFor(1min);
    std::string last;
    for (const auto& [tag, record] : gate.ReadAll()) {
      EXPECT_GT(tag, last) << "doubled, or out of order";
      last = tag;
      if (record.state != RecordState::read) {
        EXPECT_EQ(record.state, RecordState::superseded) << record.text;
        ++superseded;
        continue;
      }
      ++read;
      const std::string said = ToText(record.values[0].value);
      EXPECT_TRUE(said == tag || said == kNoTag) << said << " with tag " << tag;
      EXPECT_EQ(ToText(record.values[1].value), said == tag ? "1" : "0");
    }
  }
  EXPECT_GT(read, 50 * seeds);
  EXPECT_GT(superseded, seeds);
}

TEST(StoppedReader, DatesItsTagBeforeTheStop) {
  for (const bool timers_first : {false, true}) {
    VirtualLine line(GateLine(), {&ReaderProtocol()});
    line.Open();
    line.RunFor(5s);
    line.Inject(protocols::reader::EncodeTag("0A00112233"), 1s);
    line.Stop(60s, timers_first);
    line.RunFor(100ms);
    EXPECT_GE(line.AgeOf(0, 0), 60s);
    line.RunFor(2s);
    line.Inject(protocols::reader::EncodeTag("0A00112244"));
    line.RunFor(10ms);
    EXPECT_LE(line.AgeOf(0, 0), 10ms);
  }
}

// ---------------- The clock messages T and D contain the time at which their last character is
// sent, and delay no poll.

class ClockRun : public ::testing::Test {
 protected:
  static config::OptionValue Period(Duration period) { return period.count(); }

  Rig rig_{RealLine("Spa9600"), [](config::Line& line) {
             for (config::Device& device : line.devices) {
               device.options.Set("send_seconds", Period(10s));
               device.options.Set("send_date", Period(1min));
             }
           }};

  /// Returns the difference between the sent time and the time of the last character.
  Duration Error(const Sent& sent) const {
    constexpr Duration kCharacter = Duration(1s) / 960;  // ten bits at 9600 bit/s
    const std::size_t at = sent.text.rfind(':', sent.text.size() - 4) - 6;
    double said = 0;
    std::from_chars(sent.text.data() + at, sent.text.data() + at + 6, said);
    const auto characters = static_cast<std::int64_t>(sent.text.size());
    const WallTime end =
        rig_line_.now().wall - (rig_line_.now().instant - sent.at) + characters * kCharacter;
    const Duration minute = end.time_since_epoch() % Duration(1min);
    return std::chrono::abs(minute -
                            std::chrono::round<Duration>(std::chrono::duration<double>(said)));
  }
  VirtualLine& rig_line_ = rig_.line();
};

TEST_F(ClockRun, SendsTheTimeOnlyWhileTheHostClockIsRight) {
  rig_.LearnTruth();
  rig_.Watch();
  rig_->RunFor(1min);
  EXPECT_EQ(rig_->CountSent(">900W"), 0U) << "nobody has said that the clock is right";
  rig_->poller().OnHostClock(true);
  rig_->sent.clear();
  rig_->RunFor(10min);
  EXPECT_NEAR(static_cast<double>(rig_->CountSent(">900WT")), 61, 1);
  EXPECT_NEAR(static_cast<double>(rig_->CountSent(">900WD")), 11, 1);
  for (const Sent& sent : rig_->sent) {
    if (sent.text.starts_with(">900W")) {
      EXPECT_LE(Error(sent), 1ms) << sent.text;
    }
  }
  EXPECT_EQ(rig_.wrong(), 0U);
  EXPECT_TRUE(rig_.AllGood());
  for (std::uint32_t i = 0; i < rig_.devices(); ++i) EXPECT_EQ(rig_->StatusOf(i).retries, 0U);

  rig_->poller().OnHostClock(false);
  rig_->sent.clear();
  rig_->RunFor(2min);
  EXPECT_EQ(rig_->CountSent(">900W"), 0U);
}

TEST_F(ClockRun, SendsTheRightTimeAfterSilenceAndLateReplies) {
  rig_.LearnTruth();
  rig_->poller().OnHostClock(true);
  rig_->twin(1).manner.dead = true;
  rig_->twin(0).manner.think = 480ms;
  rig_->sent.clear();
  rig_->RunFor(5min);
  EXPECT_GE(rig_->CountSent(">900WT"), 20U);
  for (const Sent& sent : rig_->sent) {
    if (sent.text.starts_with(">900W")) {
      EXPECT_LE(Error(sent), 1ms) << sent.text;
    }
  }
}

}  // namespace
}  // namespace baudgate::protocols
