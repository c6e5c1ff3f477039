// Tests that each record of a load profile is reported once, with the value of the simulated
// device.
// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <functional>
#include <map>
#include <memory>
#include <random>

#include "gateway/base/text.h"
#include "protocols/set4tm/archive/archive.h"
#include "protocols/set4tm/meter/codec.h"
#include "protocols/set4tm/twin/twin_archive.h"
#include "tests/protocols/set4tm/support.h"

namespace baudgate::protocols::set4tm {
namespace {

using Utc = CivilZone::Utc;

constexpr Utc kBegin = std::chrono::sys_days(std::chrono::year(2026) / 9 / 1);

struct Ways {
  std::string zone = "+03:00";
  unsigned minutes = 30;
  std::size_t bytes = 65536;
  std::uint8_t type = 8;
};

Settings SettingsOf(const Ways& ways) {
  Settings settings;
  settings.time_zone = *CivilZone::Parse(ways.zone);
  settings.load_profiles = {1};
  settings.load_records = static_cast<int>(ways.bytes / kLoadRecord);
  return settings;
}

Scale Unit() {
  Scale scale;
  scale.meter_constant = 0.5;  // one count is one kWh
  scale.voltage_ratio = scale.current_ratio = 1;
  return scale;
}

class LoadDesk {
 public:
  explicit LoadDesk(const Ways& its = {})
      : ways(its), twin(*CivilZone::Parse(its.zone), its.minutes, its.bytes, kBegin) {
    Restart();
  }

  void Restart() {
    session_ = std::make_unique<LoadSession>(SettingsOf(ways));
    EXPECT_FALSE(session_->due()) << "nobody knows what was told";
    session_->OnKept(said);
    session_->OnMeter(meter);
    session_->OnType(ways.type);
  }

  void Pass(Duration time) { now_ += time; }

  void Run(Duration time) {
    const Instant end = now_ + time;
    while (true) {
      const auto due = session_->due();
      if (!due || *due > end) break;
      now_ = std::max(now_, *due) + 1s;
      Task();
    }
    now_ = std::max(now_, end);
  }

  void Task() {
    twin.Advance(utc());
    const Bytes pdu = session_->Next(now_);
    asked.push_back(ToHex(pdu));
    if (lost && lost()) return session_->OnFailure(now_);
    if (deaf && pdu[0] == kMemoryTagged) {
      Answer refusal;
      refusal.outcome = Outcome::unsupported;
      EXPECT_EQ(session_->TakeRefusal(refusal, now_).outcome, Outcome::ok);
      return;
    }
    const Answer answer = session_->Take(Reply(pdu), Unit(), now_);
    if (answer.batch) Take(*answer.batch);
  }

  Utc utc() const {
    return kBegin + std::chrono::duration_cast<std::chrono::seconds>(now_ - Instant());
  }
  LoadSession& session() { return *session_; }

  void ExpectAll(Utc from = kBegin) const {
    const std::chrono::minutes span(ways.minutes);
    Utc next = from;
    for (const PastRecord& record : told) {
      if (Begin(record) < from) continue;
      ASSERT_EQ(FormatWallTime(WallTime(Begin(record))), FormatWallTime(WallTime(next)));
      const auto pulses = TwinLoad::PulsesOf(next);
      for (std::size_t i = 0; i < pulses.size(); ++i) {
        const double power = pulses[i] * 60.0 / ways.minutes;
        ASSERT_EQ(record.values[i].value, Value(power)) << FormatWallTime(WallTime(next));
        ASSERT_TRUE(IsGood(record.values[i].quality));
      }
      next += span;
    }
    // The slices of an hour (periods of `span`) can be read when its first slice is over.
    EXPECT_GE(next, utc() - span - LoadSession::kLook - 1min);
    EXPECT_LE(next, utc());
  }
  static Utc Begin(const PastRecord& record) {
    return Utc(std::chrono::duration_cast<std::chrono::seconds>(record.begin));
  }

  const Ways ways;
  TwinLoad twin;
  std::uint32_t meter = kMeter;
  std::string said;
  std::vector<PastRecord> told;
  std::vector<PastRecord> gaps;
  std::vector<std::string> asked;
  std::function<bool()> lost;
  std::function<bool()> dropped;
  bool deaf = false;
  bool odd = false;  // the reply has two extra bytes after the id
  std::optional<Bytes> unwritten;
  std::optional<Bytes> pointer;

 private:
  Bytes Reply(const Bytes& pdu) {
    if (pdu[0] == kRead) {
      if (pdu[1] == 0x04) return pointer.value_or(twin.Pointer());
      return {0, static_cast<std::uint8_t>(ways.minutes)};
    }
    const bool tagged = pdu[0] == kMemoryTagged;
    const View place = View(pdu).subspan(tagged ? 2 : 1);
    EXPECT_EQ(place[0], 3);
    const std::size_t most = ways.type == 0 ? 16 : 92;
    EXPECT_LE(place[3], most);
    Bytes data;
    if (tagged) data.push_back(pdu[1]);
    if (tagged && odd) Append(data, Bytes{0xAA, 0xBB});
    const std::size_t address = *ByteReader(place).U16Be(1);
    auto memory = twin.Memory(address, place[3]);
    EXPECT_TRUE(memory) << ToHex(pdu);
    if (memory && unwritten) HideHeader(address, *memory);
    Append(data, memory.value_or(Bytes(place[3])));
    return data;
  }

  /// Overwrites the header of the current hour. A meter advances its pointer before it writes this
  /// header.
  void HideHeader(std::size_t address, Bytes& memory) const {
    const auto pointer = ParseLoadPointer(twin.Pointer());
    const std::size_t hour = LoadRing{ways.bytes, ways.minutes}.HourOf(*pointer)->address;
    for (std::size_t i = 0; i < kLoadRecord; ++i) {
      const std::size_t at = hour + i - address;
      if (hour + i >= address && at < memory.size()) memory[at] = (*unwritten)[i];
    }
  }

  void Take(const EventBatch& batch) {
    ASSERT_FALSE(batch.past.empty());
    if (dropped && dropped()) return Restart();
    for (const PastRecord& record : batch.past) {
      (record.values.empty() ? gaps : told).push_back(record);
    }
    said = batch.said;
    session_->OnKept(said);
  }

  Instant now_{};
  std::unique_ptr<LoadSession> session_;
};

TEST(LoadSession, ReadsTheHistoryAndThenNewRecords) {
  LoadDesk service;
  service.Pass(5 * 24h);
  service.Run(1h);
  service.ExpectAll();
  service.Run(10 * 24h);
  service.ExpectAll();
  EXPECT_TRUE(service.gaps.empty());
  EXPECT_EQ(service.session().Shown(), "load_1 is read up to 2026-09-16T00:30:00.000Z");
}

TEST(LoadSession, ReadsAtMostThreeHoursPerExchange) {
  LoadDesk service;
  service.Pass(100 * 24h);
  service.Run(1h);
  EXPECT_GE(service.told.size(), 100U * 48);
  EXPECT_LE(service.asked.size(), 100U * 24 / 2 + 20);
  EXPECT_EQ(service.asked[0], "08 06");
  EXPECT_EQ(service.asked[1], "08 04");
  EXPECT_EQ(service.asked[2], "0C 01 03 00 00 58");
  EXPECT_EQ(service.asked[3], "0C 02 03 00 00 48") << "three hours";
}

TEST(LoadSession, ContinuesAfterAnOutageOfDays) {
  LoadDesk service;
  service.Run(26h);
  service.Pass(20 * 24h + 7min);
  service.Restart();
  service.Run(1h);
  service.ExpectAll();
  EXPECT_TRUE(service.gaps.empty());
}

TEST(LoadSession, AWrappedRingLosesNothing) {
  LoadDesk service({.bytes = 4096});
  service.Run(40 * 24h);
  service.ExpectAll();
  EXPECT_TRUE(service.gaps.empty());
}

TEST(LoadSession, AnOverwrittenRingIsAGap) {
  LoadDesk service({.bytes = 4096});
  service.Run(100h);
  service.Pass(250h);
  service.Restart();
  service.Run(2h);
  ASSERT_EQ(service.gaps.size(), 1U);
  const Utc lost = LoadDesk::Begin(service.gaps[0]);
  const Utc found = lost + std::chrono::duration_cast<std::chrono::seconds>(service.gaps[0].span);
  EXPECT_GE(lost, kBegin + 99h);
  EXPECT_EQ(found, kBegin + 350h - 169h);
  for (auto& record : service.told)
    ASSERT_TRUE(LoadDesk::Begin(record) < lost || LoadDesk::Begin(record) >= found);
  std::erase_if(service.told,
                [found](const PastRecord& one) { return LoadDesk::Begin(one) < found; });
  service.ExpectAll(found);
  service.Restart();
  service.Run(100h);
  EXPECT_EQ(service.gaps.size(), 1U);
  service.ExpectAll(found);
}

TEST(LoadSession, AnExactlyFullRingIsNoGap) {
  for (const int hours : {168, 169, 170, 171}) {
    SCOPED_TRACE(hours);
    LoadDesk service({.bytes = 4096});
    service.Run(100h);
    service.Pass(std::chrono::hours(hours));
    service.Restart();
    service.Run(2h);
    EXPECT_EQ(service.gaps.empty(), hours < 169) << "the half hour before the outage";
  }
}

TEST(LoadSession, ReadsOverBeginAndEndOfSummerTime) {
  LoadDesk service({.zone = "+01:00 eu"});
  service.Run(70 * 24h);
  service.ExpectAll();
  service.Pass(80 * 24h);
  service.Run(90 * 24h);
  service.ExpectAll();
}

TEST(LoadSession, ReadsOldMetersAndOtherIntervals) {
  for (const unsigned minutes : {1U, 3U, 15U, 30U, 60U}) {
    for (const std::uint8_t type : {std::uint8_t{0}, std::uint8_t{8}}) {
      for (const bool deaf : {false, true}) {
        SCOPED_TRACE("T " + std::to_string(minutes) + ", type " + std::to_string(type));
        LoadDesk service({.minutes = minutes, .bytes = 8192, .type = type});
        service.deaf = deaf;
        service.odd = !deaf;
        service.Run(12h);
        service.ExpectAll();
        EXPECT_TRUE(service.gaps.empty());
      }
    }
  }
}

TEST(LoadSession, PowerOutagesAreIncompleteOrMissingRecords) {
  LoadDesk service;
  service.Run(10h);
  service.twin.PowerOff(kBegin + 10h + 10min, kBegin + 10h + 20min);
  service.twin.PowerOff(kBegin + 12h + 40min, kBegin + 20h + 10min);
  service.Pass(20h);
  service.Run(2h);
  std::map<std::string, bool> good;
  for (const PastRecord& record : service.told) {
    good[FormatWallTime(WallTime(LoadDesk::Begin(record))).substr(11, 5)] =
        IsGood(record.values[0].quality);
  }
  EXPECT_EQ(good["10:00"], false);
  EXPECT_EQ(good["10:30"], true);
  EXPECT_EQ(good["12:30"], false);
  EXPECT_EQ(good.count("13:00"), 0U);
  EXPECT_EQ(good["20:00"], false);
  EXPECT_EQ(good["20:30"], true);
  EXPECT_TRUE(service.gaps.empty()) << "nothing was lost";
}

TEST(LoadSession, AnotherMeterContinuesWhereTheLastEnded) {
  LoadDesk service;
  service.Run(50h);
  service.meter = kMeter + 1;
  service.twin = TwinLoad(*CivilZone::Parse("+03:00"), 30, 65536, kBegin - 100h);
  service.Pass(3h);
  service.Restart();
  service.Run(1h);
  service.ExpectAll();
  EXPECT_TRUE(service.gaps.empty());
  service.Restart();
  service.Run(20h);
  service.ExpectAll();
  service.meter = kMeter + 2;
  service.twin = TwinLoad(*CivilZone::Parse("+03:00"), 30, 65536, service.utc() + 10h);
  service.Pass(12h);
  service.Restart();
  service.Run(1h);
  ASSERT_EQ(service.gaps.size(), 1U);
  EXPECT_GE(service.gaps[0].span, 10h);
}

TEST(LoadSession, AClearedMemoryIsAGapWithoutDuplicates) {
  LoadDesk service;
  service.Run(50h);
  service.twin = TwinLoad(*CivilZone::Parse("+03:00"), 30, 65536, kBegin + 55h);
  service.Pass(10h);
  service.Run(2h);
  ASSERT_EQ(service.gaps.size(), 1U);
  EXPECT_EQ(LoadDesk::Begin(service.gaps[0]) +
                std::chrono::duration_cast<std::chrono::seconds>(service.gaps[0].span),
            kBegin + 55h);
  service.ExpectAll(kBegin + 55h);
}

/// Bytes in place of a header that has not been written yet.
class LoadHeaderMissing : public testing::TestWithParam<const char*> {
 protected:
  static Bytes Unwritten() { return *ParseHex(GetParam()); }
};

TEST_P(LoadHeaderMissing, ReadsTheExistingRecordsAndWaitsForTheNextSlice) {
  for (const std::size_t bytes : {65536U, 4096U}) {
    for (const Duration age : {Duration(0s), Duration(30h), Duration(10 * 24h)}) {
      LoadDesk service({.bytes = bytes});
      service.Pass(age);
      service.unwritten = Unwritten();
      service.Run(2h);
      const std::size_t asked = service.asked.size();
      service.Run(48h);
      EXPECT_LE(service.asked.size() - asked, 48U * 12 * 6) << bytes << " " << age / 1h;
      service.unwritten.reset();
      service.Run(2h);
      EXPECT_TRUE(service.gaps.empty());
      service.ExpectAll(service.told.empty() ? kBegin : LoadDesk::Begin(service.told.front()));
      EXPECT_GE(service.told.size(), 90U);
    }
  }
}
INSTANTIATE_TEST_SUITE_P(, LoadHeaderMissing,
                         testing::Values("FF FF FF FF FF FF FF FF", "00 00 00 00 00 00 00 00",
                                         "14 14 08 02 00 1E 50 00", "14 14 08 35 00 1E 83 00",
                                         "00 64 00 00 80 0A 00 00"));

TEST(LoadSession, APointerAfterTheLastRecordIsAccepted) {
  for (const unsigned minutes : {30U, 15U, 60U}) {
    for (const std::size_t bytes : {65536U, 4096U, 120U * 24}) {
      for (const Duration age : {Duration(2h), Duration(60h + 10min), Duration(10 * 24h + 5min)}) {
        LoadDesk service({.minutes = minutes, .bytes = bytes});
        service.twin.WriteHeadersLate();
        service.Pass(age);
        service.Run(48h);
        EXPECT_TRUE(service.gaps.empty()) << minutes << " " << bytes << " " << age / 1h;
        service.ExpectAll(service.told.empty() ? kBegin : LoadDesk::Begin(service.told.front()));
        EXPECT_GE(service.told.size(), 46U * 60 / minutes);
      }
    }
  }
  LoadDesk first;
  first.twin.WriteHeadersLate();
  first.Pass(60h + 10min);
  first.Run(1min);
  EXPECT_EQ(first.told.size(), 120U) << "within a minute, in an hour without a header";
}

TEST(LoadSession, AnInvalidMemoryPointerIsReported) {
  LoadDesk service;
  service.pointer = *ParseHex("10 15 03 09 26 05 A4");
  service.Pass(60h);
  service.Run(1min);
  EXPECT_NE(service.session().Shown().find("05 A4"), std::string::npos)
      << service.session().Shown();
  service.pointer = *ParseHex("10 15 03 09 26 05 98");
  service.Run(6min);
  EXPECT_NE(service.session().Shown().find("0598"), std::string::npos) << service.session().Shown();
  EXPECT_TRUE(service.told.empty());
  service.pointer.reset();
  service.Run(6min);
  EXPECT_EQ(service.told.size(), 120U);
  EXPECT_EQ(service.session().Shown().find("08 04"), std::string::npos);
}

TEST(LoadSession, InvalidStoredTextIsIgnored) {
  for (const char* said : {"", "x", "9020001", "9020001 ", "9020001 1:zz", "-1 1:-",
                           "9020001 ;;:", "9020001 4:0000:1414080200023437:1"}) {
    LoadDesk service;
    service.said = said;
    service.Restart();
    service.Run(5h);
    service.ExpectAll();
  }
}

TEST(LoadSession, EachRecordIsReportedOnceInSpiteOfDisturbances) {
  std::size_t told = 0;
  for (unsigned seed = 1; seed <= 12 && !testing::Test::HasFailure(); ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    std::mt19937 random(seed);
    const auto one_in = [&random](unsigned n) { return random() % n == 0; };
    LoadDesk service({.zone = seed % 2 == 0 ? "+01:00 eu" : "-03:00",
                      .minutes = seed % 3 == 0 ? 15U : 30U,
                      .bytes = 16384,
                      .type = static_cast<std::uint8_t>(seed % 4 == 0 ? 0 : 8)});
    service.deaf = seed % 5 == 0;
    service.lost = [&] { return one_in(30); };
    service.dropped = [&] { return one_in(10); };
    for (int round = 0; round < 30; ++round) {
      service.Run(std::chrono::minutes(random() % 4000));
      if (one_in(2)) service.Pass(std::chrono::minutes(random() % 9000));
      if (one_in(3)) service.Restart();
      if (one_in(3)) service.session().OnReconnect();
    }
    service.lost = service.dropped = [] { return false; };
    service.Run(4h);
    service.ExpectAll();
    EXPECT_TRUE(service.gaps.empty());
    told += service.told.size();
  }
  EXPECT_GT(told, 12'000U);
}

}  // namespace
}  // namespace baudgate::protocols::set4tm
