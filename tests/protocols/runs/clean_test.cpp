// Tests real protocols on a good line: every point becomes good as soon as the wire allows.
// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <set>
#include <string>
#include <vector>

#include "gateway/base/bytes.h"
#include "gateway/base/text.h"
#include "gateway/bus/poller/poller.h"
#include "protocols/dcon/protocol.h"
#include "tests/config/shipped.h"
#include "tests/protocols/runs/birth_oracle.h"
#include "tests/protocols/runs/lag_rig.h"
#include "tests/protocols/runs/rig.h"
#include "tests/support/transcript.h"
#include "tests/support/virtual_line.h"

namespace baudgate::protocols {
namespace {

class CleanRun : public ::testing::TestWithParam<Setup> {};

Duration WireTime(Rig& rig) {
  const bus::LineCounters& counters = rig->poller().accounts().line.counters();
  return static_cast<std::int64_t>(counters.bytes_in + counters.bytes_out) *
         rig.setup().serial.CharacterTime();
}

TEST_P(CleanRun, EveryPointBecomesGoodWithTheValueOfTheTwin) {
  Rig rig(GetParam());
  rig.LearnTruth();
  for (std::uint32_t device = 0; device < rig.devices(); ++device) {
    const bus::DeviceStatus status = rig->StatusOf(device);
    EXPECT_EQ(status.retries, 0U);
    EXPECT_EQ(status.state, bus::DeviceState::online);
    EXPECT_EQ(status.Count(Outcome::ok), status.exchanges);
  }
  EXPECT_EQ(rig->poller().accounts().line.counters().stray_bytes, 0U);
}

TEST_P(CleanRun, TheFirstRoundTakesHardlyMoreThanItsBytes) {
  Rig rig(GetParam(), [](config::Line& line) {
    for (config::Device& device : line.devices) device.poll = 1h;
  });
  rig.LearnTruth();
  const Duration pause = *GetParam().protocol->timing(GetParam().serial).quiet +
                         rig->twin(0).manner.think + rig.setup().serial.CharacterTime();
  EXPECT_LE(rig->elapsed(), WireTime(rig) + static_cast<std::int64_t>(rig->sent.size()) * pause);
  std::set<std::string> different;
  for (const Sent& sent : rig->sent) different.insert(sent.text);
  const std::size_t probes = 3 * rig.devices();
  const std::size_t identity = 4 * rig.devices();
  EXPECT_LE(rig->sent.size(), different.size() + probes + identity + 4) << "requests made twice";
}

TEST_P(CleanRun, AnOverloadedLineIsNeverIdle) {
  Rig rig(GetParam(), [](config::Line& line) {
    for (config::Device& device : line.devices) device.poll = 1ms;
  });
  rig.LearnTruth();
  rig.Watch();
  const Duration busy = rig->poller().accounts().line.counters().busy;
  rig->RunFor(30s);
  const double share =
      std::chrono::duration<double>(rig->poller().accounts().line.counters().busy - busy) / 30s;
  EXPECT_GT(share, 0.99);
  EXPECT_TRUE(rig.AllGood()) << "the slow group has its turn";
  EXPECT_EQ(rig->StatusOf(0).retries, 0U);
}

TEST_P(CleanRun, APollPeriodIsKept) {
  Rig rig(GetParam(), [](config::Line& line) {
    for (config::Device& device : line.devices) device.poll = 5s;
  });
  rig.LearnTruth();
  rig.Watch();
  const std::uint64_t before = rig->poller().accounts().line.counters().exchanges;
  rig->RunFor(10s);
  const std::uint64_t two_rounds = rig->poller().accounts().line.counters().exchanges - before;
  rig->RunFor(10min - 10s);
  const std::uint64_t all = rig->poller().accounts().line.counters().exchanges - before;
  EXPECT_GE(all, 48 * two_rounds);
  for (std::uint32_t device = 0; device < rig.devices(); ++device) {
    EXPECT_EQ(rig->StatusOf(device).missed, 0U);
    EXPECT_TRUE(rig.AllGood(device));
  }
}

TEST_P(CleanRun, BurstsOfAUsbAdapterAreNoErrorAndCostOnlyTheirLatency) {
  constexpr Duration kLatency = 16ms;
  Rig clean(GetParam());
  clean.LearnTruth();
  clean->RunFor(2min);
  Rig rig(GetParam());
  rig.LearnTruth();
  rig.Watch();
  const Duration character = GetParam().serial.CharacterTime();
  for (std::uint32_t device = 0; device < rig.devices(); ++device) {
    rig->twin(device).manner.deliver = [&, character](View, const Bytes& reply, Instant end) {
      std::vector<tools::TimedPiece> pieces;
      Duration at = 5ms;
      for (const std::uint8_t byte : reply) {
        at += character;
        const Instant handed_over = std::chrono::ceil<std::chrono::milliseconds>(end + at);
        const Duration after_grid = handed_over.time_since_epoch() % kLatency;
        const Duration after = handed_over - end + (kLatency - after_grid) % kLatency;
        if (pieces.empty() || pieces.back().after != after) pieces.push_back({after, {}});
        pieces.back().bytes.push_back(byte);
      }
      return pieces;
    };
  }
  const std::uint64_t stray = rig->poller().accounts().line.counters().stray_bytes;
  rig->RunFor(2min);
  for (std::uint32_t device = 0; device < rig.devices(); ++device) {
    const bus::DeviceStatus status = rig->StatusOf(device);
    EXPECT_EQ(status.Count(Outcome::ok), status.exchanges);
    EXPECT_LE(status.round_trips.mean(),
              clean->StatusOf(device).round_trips.mean() + kLatency + 1ms);
  }
  EXPECT_EQ(rig->poller().accounts().line.counters().stray_bytes, stray);
  EXPECT_EQ(rig.wrong(), 0U);
}

INSTANTIATE_TEST_SUITE_P(Real, CleanRun, ::testing::ValuesIn(RealLines()), SetupName);
INSTANTIATE_TEST_SUITE_P(Network, CleanRun, ::testing::Values(TcpLine()), SetupName);

constexpr char kFolder[] = "tests/transcripts";

std::vector<std::string> Files() {
  std::vector<std::string> files;
  std::error_code error;
  for (const auto& entry : std::filesystem::directory_iterator(kFolder, error)) {
    files.push_back(entry.path().filename().string());
  }
  std::sort(files.begin(), files.end());
  return files;
}

std::string PrefixOf(const std::string& file) { return file.substr(0, file.find('-')); }

class GoldenTranscript : public ::testing::TestWithParam<std::string> {};

TEST_P(GoldenTranscript, MatchesTheReplay) {
  ASSERT_TRUE(GetParam().ends_with(".transcript")) << "no transcript: " << GetParam();
  const Protocol* protocol = testing::Shipped().FindProtocol(PrefixOf(GetParam()));
  ASSERT_NE(protocol, nullptr) << "no protocol of this name: " << GetParam();
  PlayTranscript(*protocol, std::string(kFolder) + "/" + GetParam());
}

INSTANTIATE_TEST_SUITE_P(Files, GoldenTranscript, ::testing::ValuesIn(Files()),
                         [](const ::testing::TestParamInfo<std::string>& info) {
                           std::string name = info.param.substr(0, info.param.find('.'));
                           std::replace(name.begin(), name.end(), '-', '_');
                           return name;
                         });
GTEST_ALLOW_UNINSTANTIATED_PARAMETERIZED_TEST(GoldenTranscript);

/// An empty or missing folder would give a suite without tests, which passes.
TEST(GoldenTranscripts, EveryProtocolHasSome) {
  std::set<std::string> prefixes;
  for (const std::string& file : Files()) prefixes.insert(PrefixOf(file));
  std::set<std::string> protocols;
  for (const auto& [name, protocol] : testing::Shipped().protocols) protocols.insert(name);
  EXPECT_EQ(prefixes, protocols);
}

/// ">+720.32" and ">+020.39" have the same 8-bit sum.
constexpr double kTrue = 20.39;
constexpr std::string_view kDamaged = ">+720.32";

Bytes WithSum(std::string_view text) {
  const Bytes body = ToBytes(text);
  return ToBytes(std::string(text) + HexByte(Sum8(body)) + "\r");
}

class FirstReading : public ::testing::TestWithParam<config::Recheck> {
 protected:
  FirstReading() {
    config::Line line = LineOf(RealLine("Dcon9600"));
    line.devices.resize(1);
    config::Device& device = line.devices[0];
    device.poll = 1s;
    device.trust_order = true;
    device.options.Set("identify", false);
    device.options.Set("channel_types", false);
    device.options.Set("channels", std::int64_t{0});
    config::Point point;
    point.name = "input";
    point.read = "#[0]";
    point.recheck = GetParam();
    device.points = {point};
    line_ = std::make_unique<VirtualLine>(line, std::vector{&DconProtocol()});
    line_->twin(0).values.Set(0, kTrue);
    line_->always = [this] {
      const bool good = IsGood(line_->QualityOf(0, 0));
      wrong_ = wrong_ || (good && line_->ValueOf(0, 0) != Value(kTrue));
    };
  }
  void Damage() {
    line_->twin(0).manner.instead = [once = true](View) mutable -> std::optional<Bytes> {
      return std::exchange(once, false) ? std::optional(WithSum(kDamaged)) : std::nullopt;
    };
  }
  bool IsGoodWithin(Duration limit) {
    return line_->RunUntil([this] { return IsGood(line_->QualityOf(0, 0)); }, limit);
  }

  std::unique_ptr<VirtualLine> line_;
  bool wrong_ = false;
};

TEST_P(FirstReading, OfAPointIsNeverUsedAlone) {
  Damage();
  line_->Open();
  EXPECT_TRUE(IsGoodWithin(20s));
  line_->RunFor(1min);
  EXPECT_FALSE(wrong_);
}

TEST_P(FirstReading, AfterAnOutageIsNeverUsedAlone) {
  line_->Open();
  EXPECT_TRUE(IsGoodWithin(20s));
  for (const Duration outage : {Duration(4s), Duration(1min)}) {
    line_->twin(0).manner.dead = true;
    line_->RunFor(outage);
    line_->twin(0).manner.dead = false;
    Damage();
    EXPECT_TRUE(IsGoodWithin(1min));
    line_->RunFor(1min);
  }
  EXPECT_FALSE(wrong_);
}

INSTANTIATE_TEST_SUITE_P(Rules, FirstReading,
                         ::testing::Values(config::Recheck::jump, config::Recheck::always));

// ---------------- Tests of BirthOracle: it reports nothing on undisturbed lines, and detects each
// kind of wrong value.

class Undisturbed : public ::testing::TestWithParam<LagCase> {};

TEST_P(Undisturbed, AllValuesAreRightAndGood) {
  LagRig rig(GetParam(), 1);
  rig.Open();
  rig.oracle().RestartAvailability();
  for (int minute = 0; minute < 3; ++minute) {
    rig.RunFor(1min);
    for (std::uint32_t device = 0; device < rig.devices(); ++device) rig.Write(device);
  }
  rig.RunFor(20s);
  EXPECT_EQ(rig.oracle().wrong(), 0U) << rig.oracle().what();
  EXPECT_GT(rig.oracle().judged(), 150U);
  EXPECT_GT(rig.oracle().Availability(), 0.99);
  const bool writes = WritablePoint(*rig->store().device(0)).has_value();
  EXPECT_EQ(rig.confirmed(), writes ? 6U : 0U);
}

INSTANTIATE_TEST_SUITE_P(Lines, Undisturbed, ::testing::ValuesIn(LagCases()), LagCaseName);

class Judged {
 public:
  Judged() : rig(LagCaseOf("ModbusRtu19200", Queries::many, Proof::answered), 1) {
    rig->RunFor(200s);
    now_ = rig->now();
  }

  std::string Shows(double value, Duration age = {}) { return ShowsAt(0, value, age); }
  std::string ShowsAt(std::uint32_t point, double value, Duration age = {}) {
    const bus::Sample sample{point, value, Quality::good};
    rig->store().SetOverride(0, std::nullopt);
    rig->store().Update(0, std::span(&sample, 1), {now_.instant - age, now_.wall - age}, 10ms);
    rig.oracle().Look();
    return rig.oracle().what();
  }
  double BornAt(std::size_t twin, std::size_t point, Duration ago = {}) {
    return ToDouble(rig->twin(twin).values.Get(point, now_.instant - ago));
  }

  LagRig rig;

 private:
  Now now_;
};

using ::testing::HasSubstr;

TEST(BirthOracle, AcceptsAValueAtMostAPollOlderThanItsStamp) {
  Judged judged;
  EXPECT_EQ(judged.Shows(judged.BornAt(0, 0)), "");
  EXPECT_EQ(judged.Shows(judged.BornAt(0, 0, 1900ms)), "");
  EXPECT_EQ(judged.Shows(judged.BornAt(0, 0, 3s), 1500ms), "");
  EXPECT_THAT(judged.Shows(judged.BornAt(0, 0, 2100ms)), HasSubstr("older than its stamp"));
  EXPECT_EQ(judged.rig.oracle().wrong(), 1U);
  EXPECT_EQ(judged.rig.oracle().judged(), 4U);
}

TEST(BirthOracle, DetectsAValueOfAnotherPoint) {
  Judged judged;
  EXPECT_THAT(judged.Shows(judged.BornAt(0, 1)), HasSubstr("the value of twin 0, point 1"));
}

TEST(BirthOracle, DetectsAValueOfAnotherDevice) {
  Judged judged;
  EXPECT_THAT(judged.Shows(judged.BornAt(1, 0)), HasSubstr("the value of twin 1"));
}

TEST(BirthOracle, DetectsAnUnknownValue) {
  Judged judged;
  EXPECT_THAT(judged.Shows(123456.5), HasSubstr("nobody's value"));
}

TEST(BirthOracle, AcceptsValuesOfADemandedReplacement) {
  Judged judged;
  judged.rig.oracle().Replace(0, 2, false);
  EXPECT_EQ(judged.Shows(judged.BornAt(2, 0)), "");
  judged.rig.oracle().Replace(0, 3, true);
  EXPECT_THAT(judged.Shows(judged.BornAt(3, 0)), HasSubstr("not the demanded one"));
}

TEST(BirthOracle, DetectsMixedValuesOfAReplacedDevice) {
  Judged judged;
  EXPECT_EQ(judged.Shows(judged.BornAt(0, 0)), "");
  judged.rig.oracle().Replace(0, 2, false);
  judged.rig.oracle().ForbidMixture(0);
  EXPECT_THAT(judged.ShowsAt(1, judged.BornAt(2, 1)), HasSubstr("of the replaced device"));
}

TEST(BirthOracle, DetectsTheValueBeforeAConfirmedWrite) {
  Judged judged;
  const auto point = WritablePoint(*judged.rig->store().device(0));
  ASSERT_TRUE(point);
  const double before = judged.BornAt(0, *point);
  EXPECT_EQ(judged.ShowsAt(*point, before), "");
  judged.rig->twin(0).values.Set(*point, 4711.0);
  judged.rig.oracle().Confirm(0, *point, 4711);
  judged.rig.oracle().Look();
  EXPECT_THAT(judged.rig.oracle().what(), HasSubstr("before the write that was confirmed"));
  EXPECT_EQ(judged.rig.oracle().wrong(), 1U);
}

TEST(BirthOracle, MeasuresTheShareOfGoodReadings) {
  Judged judged;
  const std::size_t points =
      judged.rig->store().point_count(0) + judged.rig->store().point_count(1);
  judged.rig.oracle().RestartAvailability();
  judged.Shows(judged.BornAt(0, 0));
  judged.rig->RunFor(0s);
  EXPECT_DOUBLE_EQ(judged.rig.oracle().Availability(), 1.0 / static_cast<double>(points));
}

}  // namespace
}  // namespace baudgate::protocols
