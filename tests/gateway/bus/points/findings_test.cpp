// Tests of `Findings`, `FailureRuns`, `RoundTrips` and `LastHour`.
// SPDX-License-Identifier: Apache-2.0
#include "gateway/bus/points/findings.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <string>
#include <string_view>
#include <vector>

#include "gateway/bus/points/device_status.h"

namespace baudgate::bus {
namespace {

using enum Symptom;

Findings After(std::initializer_list<baudgate::Symptom> symptoms) {
  Findings findings;
  for (const baudgate::Symptom symptom : symptoms) findings.Add({.symptom = symptom});
  return findings;
}

TEST(Findings, OutagesAreDistinguishedFromSingleLosses) {
  const Findings losses = After({silence, clean, clean, damaged, clean, silence});
  EXPECT_EQ(losses.Runs(), 3U);
  EXPECT_EQ(losses.LongestRun(), 1U);
  const Findings outage = After({clean, silence, silence, silence, silence, clean});
  EXPECT_EQ(outage.Runs(), 1U);
  EXPECT_EQ(outage.LongestRun(), 4U);
  EXPECT_EQ(After({clean, refusal, copies}).Runs(), 0U);
}

TEST(Findings, ALaterObservationAmendsAnEarlierFinding) {
  Findings findings = After({tail_lost, clean, clean});
  findings.Amend({.symptom = split, .time = 400ms}, 2);
  EXPECT_EQ(findings.Count(tail_lost), 0U);
  EXPECT_EQ(findings.Count(split), 1U);
  EXPECT_EQ(findings.Count(clean), 2U);
  findings.Amend({.symptom = late}, 3);
  EXPECT_EQ(findings.Count(late), 0U) << "that one is not kept any more";
}

TEST(Findings, RecurringEqualBytesAreCounted) {
  Findings findings;
  for (int i = 0; i < 5; ++i) findings.Add({.symptom = few_beside, .cause = "10 02 ..."});
  findings.Add({.symptom = clean});
  EXPECT_EQ(findings.SameAround(), 5U);
  EXPECT_EQ(findings.Around(), "10 02 ...");
  findings.Add({.symptom = noise_before, .cause = "A7 31 09 5C ..."});
  EXPECT_EQ(findings.SameAround(), 1U);
}

TEST(Findings, DamagedCharactersWithoutAnEighthBitAreDetected) {
  Findings findings;
  EXPECT_FALSE(findings.specials().IsSevenBit()) << "nothing has come";
  findings.Add({.symptom = bad_check, .bytes = 7, .specials = kEvenByte | kOddByte});
  EXPECT_TRUE(findings.specials().IsSevenBit());
  findings.Add({.symptom = bad_check, .bytes = 7, .specials = kHighBit | kOddByte});
  EXPECT_FALSE(findings.specials().IsSevenBit());
}

TEST(Findings, DamagedCharactersOfOneParityAreDetected) {
  constexpr std::uint8_t kMark = 0x10;
  Findings findings;
  findings.Add({.symptom = bad_check, .bytes = 7, .specials = kEvenByte});
  EXPECT_FALSE(findings.specials().IsOneParity()) << "no FF came";
  findings.Add({.symptom = bad_check, .bytes = 7, .specials = kEvenByte | kMark});
  EXPECT_TRUE(findings.specials().IsOneParity());
  EXPECT_EQ(findings.specials().Suspects(), 0U) << "one came without FF";
  findings.Add({.symptom = bad_check, .bytes = 7, .specials = kOddByte | kMark});
  EXPECT_FALSE(findings.specials().IsOneParity());
}

TEST(Findings, SilenceOnlyAfterShortPausesIsDetected) {
  Findings findings;
  findings.Add({.symptom = silence, .idle = 90ms});
  EXPECT_EQ(findings.ShortPause(), Duration()) << "nothing was ever answered";
  findings.Add({.symptom = clean, .idle = kLongIdle});
  for (int i = 0; i < 40; ++i) findings.Add({.symptom = silence, .idle = 90ms});
  EXPECT_EQ(findings.ShortPause(), Duration(90ms)) << "the good one is long out of sight";
  findings.Add({.symptom = clean, .idle = 20ms});
  EXPECT_EQ(findings.ShortPause(), Duration());
}

/// A possible cause is a new serial server with a smaller buffer.
TEST(Findings, LongRepliesThatBecomeDamagedAreDetected) {
  Findings findings;
  const Finding whole{.symptom = clean, .bytes = 49, .expected = 49};
  const Finding cut{.symptom = tail_lost, .bytes = 32, .expected = 49};
  const Finding small{.symptom = clean, .bytes = 7, .expected = 7};
  findings.Add(whole);
  for (int i = 0; i < 23; ++i) {
    findings.Add(cut);
    findings.Add(small);
  }
  EXPECT_EQ(findings.lengths().longest_good(), 49U) << "that may be chance";
  findings.Add(cut);
  EXPECT_EQ(findings.lengths().longest_good(), 7U);
  EXPECT_EQ(findings.lengths().damaged().shortest, 49U);
  findings.Add(whole);
  EXPECT_EQ(findings.lengths().damaged().count, 0U);
}

TEST(Findings, AShortRefusalDoesNotCountAsALongReply) {
  Findings findings;
  findings.Add({.symptom = clean, .bytes = 4, .expected = 8});
  EXPECT_EQ(findings.lengths().longest_good(), 4U);
}

constexpr Instant kFirst{1000s};

/// One exchange per second: 'o' is answered, 'x' fails. '-' is a minute without exchanges.
FailureRuns After(std::string_view exchanges) {
  FailureRuns failures;
  Instant now = kFirst;
  for (const char exchange : exchanges) {
    if (exchange == '-') {
      now += 59s;
    } else {
      failures.Add(exchange == 'o', now += 1s);
    }
  }
  return failures;
}

/// Example: "2x3" is two answered exchanges, then three failures. In "2x3." no answer has followed
/// yet.
std::string ShownRuns(const FailureRuns& failures) {
  std::string text;
  for (const FailureRuns::Run& run : failures.runs()) {
    text += std::to_string(run.answered) + "x" + std::to_string(run.failed);
    text += run.after ? " " : ". ";
  }
  return text + std::to_string(failures.answered());
}

std::string Repeated(std::string_view part, int times) {
  std::string text;
  for (int i = 0; i < times; ++i) text += part;
  return text;
}

TEST(FailureRuns, AreSeparatedByAnswers) {
  const struct {
    std::string exchanges;
    std::string runs;
  } rows[] = {
      {"", "0"},
      {"ooo", "3"},
      {"xx", "0x2. 0"},
      {"ooxxxo", "2x3 1"},
      {"oxoxxoox", "1x1 1x2 2x1. 0"},
      {"x" + Repeated("o", 40) + "-----o", "41"},
      {"x" + Repeated("o", 20) + "-----o", "0x1 21"},
      {"x" + Repeated("o", 40) + "----o", "0x1 41"},
      {Repeated("ox", 20) + "o", Repeated("1x1 ", 16) + "1"},
  };
  for (const auto& row : rows)
    EXPECT_EQ(ShownRuns(After(row.exchanges)), row.runs) << row.exchanges;
}

TEST(FailureRuns, RecordTheTimesOfTheirFailuresAndTheAnswersAround) {
  const FailureRuns::Run run = After("ooxxxo").runs().front();
  EXPECT_EQ(run.before, kFirst + 2s);
  EXPECT_EQ(run.first, kFirst + 3s);
  EXPECT_EQ(run.last, kFirst + 5s);
  EXPECT_EQ(run.after, kFirst + 6s);
}

TEST(RoundTrips, EmptyIsZero) {
  const RoundTrips trips;
  EXPECT_EQ(trips.count(), 0U);
  EXPECT_EQ(trips.mean(), Duration::zero());
  EXPECT_EQ(trips.Percentile(0.99), Duration::zero());
}

TEST(RoundTrips, LastAndMeanAreExact) {
  RoundTrips trips;
  for (const Duration one : {10ms, 20ms, 60ms}) trips.Add(one);
  EXPECT_EQ(trips.count(), 3U);
  EXPECT_EQ(trips.last(), 60ms);
  EXPECT_EQ(trips.mean(), 30ms);
}

TEST(RoundTrips, PercentileIsAnUpperBoundWithinNineteenPercent) {
  std::mt19937 random(3);
  std::lognormal_distribution<double> spread(std::log(20e6), 1.0);
  RoundTrips trips;
  std::vector<double> all;
  for (int i = 0; i < 20000; ++i) {
    all.push_back(std::clamp(spread(random), 70e3, 60e9));
    trips.Add(Duration(std::llround(all.back())));
  }
  std::sort(all.begin(), all.end());
  for (const double share : {0.5, 0.9, 0.99, 1.0}) {
    const double truth = all[static_cast<std::size_t>(share * 19999)];
    const auto shown = static_cast<double>(trips.Percentile(share).count());
    EXPECT_GE(shown, truth * 0.999) << share;
    EXPECT_LE(shown, truth * 1.2) << share;
  }
}

TEST(RoundTrips, ExtremesStayInTheTable) {
  RoundTrips trips;
  trips.Add(Duration::zero());
  EXPECT_EQ(trips.Percentile(1), 64us);
  trips.Add(24h);
  EXPECT_GE(trips.Percentile(1), 1min);
}

TEST(Names, OutcomesAndStatesKeepTheirPublishedNames) {
  EXPECT_EQ(Name(Outcome::none), "none");
  EXPECT_EQ(Name(Outcome::unexpected), "unexpected");
  EXPECT_EQ(Name(Outcome::line_down), "line_down");
  EXPECT_EQ(static_cast<int>(Outcome::line_down), 9);
  EXPECT_EQ(static_cast<int>(DeviceState::disabled), 4);
  EXPECT_EQ(Name(DeviceState::never_seen), "never seen");
}

TEST(LastHour, ForgetsMinutesOlderThanAnHour) {
  LastHour hour;
  const Instant start = Instant() + 100h;
  for (int minute = 0; minute < 90; ++minute) {
    MinuteCounts& counts = hour.At(start + minute * 1min);
    ++counts.answered;
    counts.up += 45s;
    counts.down += 15s;
  }
  const Instant now = start + 89min;
  EXPECT_EQ(hour.Sum(now).answered, 60U);
  EXPECT_EQ(hour.Sum(now, 4).answered, 5U) << "the minute under way and four full ones";
  EXPECT_EQ(hour.Sum(now + 30min).answered, 30U);
  EXPECT_EQ(hour.Sum(now + 2h).answered, 0U);
  EXPECT_DOUBLE_EQ(Availability(hour.Sum(now)), 0.75);
  EXPECT_DOUBLE_EQ(Availability({}), 1);
}

TEST(LastHour, ReturnsEachMinuteOfTheHour) {
  LastHour hour;
  const Instant start = Instant() + 100h;
  hour.At(start).up = 60s;
  hour.At(start + 59min).down = 20s;
  const auto all = hour.All(start + 59min);
  EXPECT_EQ(all.front().up, 60s);
  EXPECT_EQ(all.back().down, 20s);
  EXPECT_EQ(all[1].up + all[1].down, 0s);
  EXPECT_EQ(hour.All(start + 60min).front().up, 0s) << "it is over";
  EXPECT_EQ(hour.All(start + 60min)[58].down, 20s);
}

}  // namespace
}  // namespace baudgate::bus
