// Tests the bytes of load profiles: examples of the manufacturer's description, seasons, powers.
// SPDX-License-Identifier: Apache-2.0
#include "protocols/set4tm/archive/load_profile.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <functional>
#include <map>
#include <memory>

#include "gateway/base/text.h"
#include "protocols/set4tm/twin/twin_archive.h"
#include "tests/protocols/set4tm/support.h"
#include "tests/support/virtual_line.h"

namespace baudgate::protocols::set4tm {
namespace {

CivilZone Zone(std::string_view text) { return *CivilZone::Parse(text); }

std::string Shown(CivilZone::Utc utc) { return FormatWallTime(WallTime(utc)).substr(0, 16); }

/// MFR 2.4.4.1: 14 h of 14.08.02, summer time, 2 min.
TEST(LoadProfile, HeaderMatchesTheDescription) {
  const Bytes bytes = Hex("14 14 08 02 00 02 34 37");
  const auto header = ParseLoadHeader(bytes);
  ASSERT_TRUE(header);
  EXPECT_EQ(Shown(UtcOf(*header, CivilZone())), "2002-08-14T14:00");
  EXPECT_TRUE(header->summer);
  EXPECT_EQ(header->minutes, 2U);
  EXPECT_EQ(header->slices(), 30U);
  Bytes again = BytesOf(*header);
  again[7] = 0x37;
  EXPECT_EQ(again, bytes);
}

TEST(LoadProfile, AHeaderNeedsAChecksumAndADate) {
  EXPECT_FALSE(ParseLoadHeader(Hex("00 00 00 00 00 00 00 00"))) << "zeros have a good sum";
  EXPECT_FALSE(ParseLoadHeader(Hex("14 14 08 02 00 02 35 37")));
  EXPECT_FALSE(ParseLoadHeader(Hex("24 14 08 02 00 02 44 00"))) << "24 h";
  EXPECT_FALSE(ParseLoadHeader(Hex("14 31 02 02 00 1E 67 00"))) << "31.02.";
  EXPECT_FALSE(ParseLoadHeader(Hex("14 14 08 02 02 02 36 37"))) << "season 2";
  EXPECT_FALSE(ParseLoadHeader(Hex("14 14 08 02 00 07 39 37"))) << "7 min do not fill an hour";
  EXPECT_FALSE(ParseLoadHeader(Hex("14 14 08 02 00 02 34")));
}

/// MFR 2.4.3.5: 11:35 of 08.09.99, address 0658.
TEST(LoadProfile, PointerMatchesTheDescription) {
  const auto pointer = ParseLoadPointer(Hex("35 11 08 09 99 06 58"));
  ASSERT_TRUE(pointer);
  EXPECT_EQ(pointer->minute, 35U);
  EXPECT_FALSE(pointer->wrapped);
  EXPECT_EQ(pointer->address, 0x0658U);
  EXPECT_EQ((LoadRing{65536, 5}.HourOf(*pointer)->address), 0x0658U - 64)
      << "the eighth slice of 5 min";
  EXPECT_EQ((LoadRing{65536, 30}.HourOf(*pointer)->address), 0x0658U - 16)
      << "within the second of 30 min";
  EXPECT_EQ((LoadRing{65536, 30}.HourOf(*pointer)->finished), 1U);
  EXPECT_EQ((LoadRing{65536, 30}.HourBehind(*pointer)->address), 0x0658U);
  EXPECT_EQ((LoadRing{0x0660, 30}.HourBehind(*pointer)->address), 0U) << "it does not fit in";
  EXPECT_TRUE(ParseLoadPointer(Hex("B5 11 08 09 99 06 58"))->wrapped);
  EXPECT_FALSE(ParseLoadPointer(Hex("65 11 08 09 99 06 58")));
  EXPECT_FALSE((LoadRing{65536, 30}.HourOf({.minute = 35, .address = 8})));
}

TEST(LoadProfile, AnHourThatDoesNotFitIsStoredAtTheBeginning) {
  const LoadRing half{65536, 30};
  EXPECT_EQ(half.Next(0), 24U);
  EXPECT_EQ(half.Next(2728 * 24), 2729U * 24);
  EXPECT_EQ(half.Next(2729 * 24), 0U) << "16 bytes are left";
  EXPECT_EQ((LoadRing{64, 60}.Next(48)), 0U);
  EXPECT_EQ((LoadRing{64, 60}.Next(32)), 48U) << "to the last byte";
}

TEST(LoadProfile, MeanPowersAreInKilowatts) {
  const LoadSlice slice = ParseLoadSlice(Hex("00 64 00 00 80 0A 7F FF"));
  const auto header = ParseLoadHeader(Hex("14 14 08 02 00 1E 50 00"));
  ASSERT_TRUE(header);
  Scale scale;
  scale.meter_constant = 5000;
  scale.voltage_ratio = 100;
  scale.current_ratio = 20;
  const PastRecord record = RecordOf(1, *header, 1, slice, Zone("+04:00"), scale);
  EXPECT_EQ(record.series, "load_1");
  EXPECT_EQ(record.span, 30min);
  EXPECT_EQ(Shown(CivilZone::Utc(std::chrono::duration_cast<std::chrono::seconds>(record.begin))),
            "2002-08-14T10:30");
  ASSERT_EQ(record.values.size(), 4U);
  EXPECT_EQ(record.values[0].name, "active_import");
  EXPECT_EQ(record.values[0].value, Value(40.0)) << "100 / 10000 kWh in half an hour, times 2000";
  EXPECT_TRUE(IsGood(record.values[0].quality));
  EXPECT_EQ(record.values[1].value, Value(0.0));
  EXPECT_EQ(record.values[2].value, Value(4.0));
  EXPECT_TRUE(IsUncertain(record.values[2].quality)) << "incomplete";
  EXPECT_TRUE(IsGood(record.values[3].quality));
  const PastRecord unknown = RecordOf(1, *header, 0, slice, CivilZone(), Scale());
  EXPECT_TRUE(IsBad(unknown.values[0].quality));
  EXPECT_EQ(unknown.values[0].value, Value());
}

TEST(LoadProfile, TheSeasonDistinguishesTheTwoHoursOfAutumn) {
  const CivilZone zone = Zone("+01:00 eu");
  const auto begin = std::chrono::local_days(std::chrono::year(2026) / 10 / 25) + 2h;
  EXPECT_EQ(Shown(UtcOf({begin, true, 30}, zone)), "2026-10-25T00:00");
  EXPECT_EQ(Shown(UtcOf({begin, false, 30}, zone)), "2026-10-25T01:00");
}

TEST(LoadProfile, ATwinRepliesByTheDescription) {
  const CivilZone::Utc begin = std::chrono::sys_days(std::chrono::year(2026) / 11 / 1);
  TwinLoad twin(Zone("+03:00"), 30, 65536, begin);
  twin.Advance(begin + 75min);
  EXPECT_EQ(ToHex(twin.Pointer()), "00 04 01 11 26 00 20") << "04:00 local, behind its header";
  twin.Advance(begin + 90min);
  EXPECT_EQ(ToHex(twin.Pointer()), "30 04 01 11 26 00 28");
  const auto header = ParseLoadHeader(*twin.Memory(24, 8));
  ASSERT_TRUE(header);
  EXPECT_EQ(UtcOf(*header, Zone("+03:00")), begin + 1h);
}

TEST(LoadPlace, IsPrintedAndParsed) {
  const LoadPlace place{0x0658, Hex("14 14 08 02 00 02 34 37"), 12};
  EXPECT_EQ(place.Text(), "0658:1414080200023437:12");
  const auto again = LoadPlace::Parse(place.Text());
  ASSERT_TRUE(again);
  EXPECT_EQ(again->Text(), place.Text());
  for (const char* text : {"", "0658", "0658:1414080200023437", "0658:1414080200023437:31",
                           "0658:1414080200023537:1", "x:1414080200023437:1", "0658::1"}) {
    EXPECT_FALSE(LoadPlace::Parse(text)) << text;
  }
}

// ---------------- Load profiles on a whole line: polls stay punctual, and each record is stored
// once, in spite of kills, absent meters and a failing disk.

using Utc = CivilZone::Utc;

config::Device Meter(const std::string& name, const std::string& address, bool load,
                     Duration poll) {
  config::Device device =
      MakeDevice(address, {MakePoint("08 1B 02 00 float_le@0"), MakePoint("08 1B 02 10 float_le@4"),
                           MakePoint("08 1B 02 20 float_le@4")});
  device.name = name;
  device.protocol = "set4tm";
  device.poll = poll;
  device.events = load;
  device.options.Set("time_zone", std::string("+03:00"));
  device.options.Set("meter_constant", std::int64_t{5000});
  if (load) device.options.Set("load_profile", std::vector<std::string>{"1"});
  return device;
}

config::Line LineOf(bool load, Duration poll) {
  config::Line line;
  line.name = "meters";
  line.protocol = "set4tm";
  line.serial = {.baud = 9600, .data_bits = 8, .parity = config::Parity::odd};
  line.devices = {Meter("m1", "5", load, poll), Meter("m2", "6", load, poll)};
  return line;
}

class Station {
 public:
  explicit Station(bool load, Duration poll = 1s) : line(LineOf(load, poll), {&Set4tmProtocol()}) {
    line.said = [this](std::uint32_t device) { return said[device]; };
    line.keep = [this](const bus::ReportedEvents& reported) {
      if (disk_fails && disk_fails()) return false;
      for (const PastRecord& record : reported.batch.past) told[reported.device].push_back(record);
      if (told[reported.device].size() < 100 * 48) read_at[reported.device] = line.now().instant;
      said[reported.device] = reported.batch.said;
      return true;
    };
    for (std::size_t i = 0; i < 2; ++i) twin(i).SetClock(line.now());
    line.Open();
  }

  MeterTwin& twin(std::size_t i) { return dynamic_cast<MeterTwin&>(*line.twin(i).twin); }
  void Fill(Utc begin) {
    for (std::size_t i = 0; i < 2; ++i) {
      *twin(i).load(1) = TwinLoad(*CivilZone::Parse("+03:00"), 30, 65536, begin);
    }
  }
  Utc utc() const { return std::chrono::floor<std::chrono::seconds>(line.now().wall); }

  VirtualLine line;
  std::map<std::uint32_t, std::string> said;
  std::map<std::uint32_t, std::vector<PastRecord>> told;
  std::map<std::uint32_t, Instant> read_at;
  std::function<bool()> disk_fails;
};

using Polls = std::map<std::string, std::vector<Instant>>;
Polls PollsSince(Instant begin, const VirtualLine& line) {
  Polls polls;
  for (const Sent& sent : line.sent) {
    const bool poll = sent.text.size() > 2 && sent.text[1] == 0x08 && sent.text[2] == 0x1B;
    if (poll && sent.at >= begin) polls[sent.text].push_back(sent.at);
  }
  return polls;
}

/// Returns how much later each poll up to `end` was sent in run `with` than in run `without`.
std::vector<Duration> Later(const Polls& with, const Polls& without, Instant end) {
  std::vector<Duration> later;
  for (const auto& [text, times] : without) {
    const std::vector<Instant>& others = with.at(text);
    for (std::size_t i = 0; i < std::min(times.size(), others.size()); ++i) {
      if (times[i] < end && others[i] > times[i]) later.push_back(others[i] - times[i]);
    }
  }
  return later;
}

std::size_t MemoryReads(const VirtualLine& line) {
  return static_cast<std::size_t>(std::ranges::count_if(
      line.sent, [](const Sent& sent) { return sent.text.size() > 1 && sent.text[1] == 0x0C; }));
}

/// Refuses to read journals. Otherwise the two runs would read journals at different times.
std::optional<Bytes> NoJournals(View request) {
  if (request[1] != kJournal && request[1] != kJournalExtended) return std::nullopt;
  return MakeFrame(request.first(1), Bytes{0x01});
}

/// Answers after 7 to 108 ms (reference, chapter 4). The time depends only on the request and on
/// how often it came before, so that it is equal in both runs.
std::function<std::optional<Bytes>(View)> Thinks(Manner& manner, bool journals) {
  auto times = std::make_shared<std::map<Bytes, std::uint32_t>>();
  return [&manner, times, journals](View request) {
    std::uint32_t hash = 2'166'136'261U + (*times)[Bytes(request.begin(), request.end())]++;
    for (const std::uint8_t byte : request) hash = (hash ^ byte) * 16'777'619U;
    manner.think = std::chrono::milliseconds(7 + (hash >> 8U) % 102);
    return journals ? std::optional<Bytes>() : NoJournals(request);
  };
}

struct Pace {
  const char* name;
  Duration poll;
  bool thinks = false;
  bool journals = false;
};
void PrintTo(const Pace& pace, std::ostream* out) { *out << pace.name; }

class LoadPace : public testing::TestWithParam<Pace> {
 protected:
  static constexpr Duration kLearns = 2min;

  std::unique_ptr<Station> Run(std::chrono::days backlog, Duration time) const {
    const Pace& pace = GetParam();
    auto station = std::make_unique<Station>(true, pace.poll);
    for (std::size_t i = 0; i < 2; ++i) {
      Manner& manner = station->line.twin(i).manner;
      manner.instead = pace.journals ? nullptr : NoJournals;
      if (pace.thinks) manner.instead = Thinks(manner, pace.journals);
    }
    station->Fill(station->utc());
    station->line.RunFor(kLearns);
    station->Fill(station->utc() - backlog);
    station->line.RunFor(time);
    return station;
  }
};

TEST_P(LoadPace, ABacklogOfAHundredDaysDelaysNoPoll) {
  const auto with = Run(std::chrono::days(100), 30min);
  const auto without = Run(std::chrono::days(0), 30min);
  ASSERT_GE(with->told[0].size(), 100U * 48) << "all of it came";
  ASSERT_GE(with->told[1].size(), 100U * 48);
  EXPECT_GT(MemoryReads(with->line), 2000U);
  EXPECT_LT(MemoryReads(without->line), 30U);
  const Instant begin = without->line.sent.front().at + kLearns;
  const Polls beside = PollsSince(begin, with->line);
  const Polls alone = PollsSince(begin, without->line);
  ASSERT_EQ(beside.size(), 6U);
  ASSERT_GE(alone.begin()->second.size(), 895U);
  // From here on, each meter is identified at another second than in the other run, so only polls
  // before are compared.
  const Instant end = std::min(with->read_at[0], with->read_at[1]);
  EXPECT_GT(end, begin + 8min) << "there is something to compare";
  EXPECT_EQ(Later(beside, alone, end), std::vector<Duration>());
}

INSTANTIATE_TEST_SUITE_P(, LoadPace,
                         testing::Values(Pace{"swift", 1s}, Pace{"slow_answers", 2s, true},
                                         Pace{"journals", 1s, false, true}),
                         [](const auto& info) { return std::string(info.param.name); });

TEST(LoadLine, ABusyLineGivesABacklogOneExchangeAMinute) {
  const auto run = [](std::chrono::days backlog) {
    auto station = std::make_unique<Station>(true, 100ms);
    for (std::size_t i = 0; i < 2; ++i) station->line.twin(i).manner.instead = NoJournals;
    station->Fill(station->utc() - backlog);
    station->line.RunFor(15min);
    return station;
  };
  const auto with = run(std::chrono::days(1));
  const auto without = run(std::chrono::days(0));
  for (std::uint32_t device = 0; device < 2; ++device) {
    EXPECT_GE(with->told[device].size(), 48U) << "an end comes: three hours a minute";
  }
  EXPECT_LE(MemoryReads(with->line), 30U);
  const auto count = [](const Station& station) {
    std::size_t polls = 0;
    for (const auto& [text, times] : PollsSince(Instant(), station.line)) polls += times.size();
    return static_cast<double>(polls);
  };
  EXPECT_GT(count(*with) / count(*without), 0.99) << "what polls lose by it";
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

TEST(LoadLine, EachRecordIsStoredOnceOverKillsAndDiskFailures) {
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
    EXPECT_NE(station.said[device].find("|" + std::to_string(kMeter) + " 1:"), std::string::npos)
        << "whose records are kept: " << station.said[device];
  }
}

}  // namespace
}  // namespace baudgate::protocols::set4tm
