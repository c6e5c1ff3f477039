// Load profiles on a whole line under virtual time: polls are as punctual as without them, and each
// record is kept once over kills, dead meters and a disk that takes nothing.
// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <functional>
#include <map>

#include "protocols/set4tm/twin_load.h"
#include "tests/protocols/set4tm/support.h"
#include "tests/support/virtual_line.h"

namespace baudgate::protocols::set4tm {
namespace {

using Utc = CivilZone::Utc;

config::Device Meter(const std::string& name, const std::string& address, bool load) {
  config::Device device =
      MakeDevice(address, {MakePoint("08 1B 02 00 float_le@0"), MakePoint("08 1B 02 10 float_le@4"),
                           MakePoint("08 1B 02 20 float_le@4")});
  device.name = name;
  device.protocol = "set4tm";
  device.poll = 1s;
  device.events = load;
  device.options.Set("time_zone", std::string("+03:00"));
  device.options.Set("meter_constant", std::int64_t{5000});
  if (load) device.options.Set("load_profile", std::vector<std::string>{"1"});
  return device;
}

config::Line LineOf(bool load) {
  config::Line line;
  line.name = "meters";
  line.protocol = "set4tm";
  line.serial = {.baud = 9600, .data_bits = 8, .parity = config::Parity::odd};
  line.devices = {Meter("m1", "5", load), Meter("m2", "6", load)};
  return line;
}

class Station {
 public:
  explicit Station(bool load) : line(LineOf(load), {&Set4tmProtocol()}) {
    line.said = [this](std::uint32_t device) { return said[device]; };
    line.keep = [this](const ReportedEvents& reported) {
      if (disk_fails && disk_fails()) return false;
      for (const PastRecord& record : reported.batch.past) told[reported.device].push_back(record);
      said[reported.device] = reported.batch.said;
      return true;
    };
    for (std::size_t i = 0; i < 2; ++i) twin(i).SetClock(line.now());
    line.Open();
  }

  MeterTwin& twin(std::size_t i) { return dynamic_cast<MeterTwin&>(*line.twin(i).twin); }
  /// The ring has filled since.
  void Fill(Utc begin) {
    for (std::size_t i = 0; i < 2; ++i) {
      *twin(i).load(1) = TwinLoad(*CivilZone::Parse("+03:00"), 30, 65536, begin);
    }
  }
  Utc utc() const { return std::chrono::floor<std::chrono::seconds>(line.now().wall); }

  VirtualLine line;
  std::map<std::uint32_t, std::string> said;
  std::map<std::uint32_t, std::vector<PastRecord>> told;
  std::function<bool()> disk_fails;
};

/// How long after the one before each float request began, once all is known that is learned at the
/// start: how often each time, in microseconds.
std::map<std::int64_t, std::size_t> Steps(const VirtualLine& line) {
  std::map<std::string, Instant> last;
  std::map<std::int64_t, std::size_t> steps;
  for (const Sent& sent : line.sent) {
    const bool poll = sent.text.size() > 2 && sent.text[1] == 0x08 && sent.text[2] == 0x1B;
    if (!poll || sent.at < line.sent.front().at + 30s) continue;
    const auto before = last.find(sent.text);
    if (before != last.end()) ++steps[(sent.at - before->second) / 1us];
    last[sent.text] = sent.at;
  }
  return steps;
}

std::size_t MemoryReads(const VirtualLine& line) {
  return static_cast<std::size_t>(std::ranges::count_if(
      line.sent, [](const Sent& sent) { return sent.text.size() > 1 && sent.text[1] == 0x0C; }));
}

/// Journals have a rhythm of their own, which is not looked at here.
std::optional<Bytes> NoJournals(View request) {
  if (request[1] != kJournal && request[1] != kJournalExtended) return std::nullopt;
  return MakeFrame(request.first(1), Bytes{0x01});
}

TEST(LoadLine, ABacklogOfAHundredDaysMakesNoPollLater) {
  const auto run = [](std::chrono::days backlog) {
    auto station = std::make_unique<Station>(true);
    for (std::size_t i = 0; i < 2; ++i) station->line.twin(i).manner.instead = NoJournals;
    station->Fill(station->utc() - backlog);
    station->line.RunFor(20min);
    return station;
  };
  const auto with = run(std::chrono::days(100));
  const auto without = run(std::chrono::days(0));
  ASSERT_GE(with->told[0].size(), 100U * 48) << "all of it came";
  ASSERT_GE(with->told[1].size(), 100U * 48);
  EXPECT_GT(MemoryReads(with->line), 2000U);
  EXPECT_LT(MemoryReads(without->line), 20U);
  const auto beside = Steps(with->line);
  EXPECT_LE(beside.rbegin()->first, 1'100'000) << "the longest wait for a poll";
  EXPECT_GT(beside.at(1'000'000), 6500U) << "polls that were punctual to the microsecond";
}

void ExpectAll(const std::vector<PastRecord>& told, Utc begin, Utc end) {
  Utc next = begin;
  for (const PastRecord& record : told) {
    ASSERT_EQ(Utc(std::chrono::duration_cast<std::chrono::seconds>(record.begin)), next);
    ASSERT_EQ(record.values.size(), 4U);
    EXPECT_DOUBLE_EQ(ToDouble(record.values[0].value), TwinLoad::PulsesOf(next)[0] / 10000.0 * 2);
    next += 30min;
  }
  EXPECT_GE(next, end);
}

TEST(LoadLine, EachRecordIsKeptOnceOverKillsAndADiskThatFails) {
  Station station(true);
  const Utc begin = std::chrono::floor<std::chrono::hours>(station.utc()) - std::chrono::days(20);
  station.Fill(begin);
  unsigned n = 0;
  station.disk_fails = [&n] { return ++n % 7 == 0; };
  for (int i = 0; i < 60; ++i) {
    station.line.RunFor(std::chrono::seconds(3 + i % 11));
    station.line.Restart();
    if (i % 5 == 4) {
      station.line.twin(0).manner.dead = true;
      station.line.RunFor(1min);
      station.line.twin(0).manner.dead = false;
    }
  }
  station.line.RunFor(2h);
  for (std::uint32_t device = 0; device < 2; ++device) {
    ExpectAll(station.told[device], begin, station.utc() - 36min);
  }
}

}  // namespace
}  // namespace baudgate::protocols::set4tm
