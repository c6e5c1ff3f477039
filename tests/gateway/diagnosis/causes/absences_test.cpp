// Outages are told from single losses by how failures stand together.
// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <random>
#include <string>
#include <string_view>

#include "gateway/base/shown.h"
#include "gateway/diagnosis/causes/evidence.h"

namespace baudgate::control {
namespace {

constexpr Instant kStart{1000s};

/// 'o' is answered, 'x' fails, each a second behind the other.
FailureRuns After(std::string_view exchanges) {
  FailureRuns failures;
  Instant now = kStart;
  for (const char exchange : exchanges) failures.Add(exchange == 'o', now += 1s);
  return failures;
}

std::string Times(int times, std::string_view part) {
  std::string text;
  for (int i = 0; i < times; ++i) text += part;
  return text;
}

/// "3.0 s every 15 s"; empty: losses.
std::string Shown(const FailureRuns& failures) {
  const auto found = FindAbsences(failures);
  if (!found) return {};
  return FormatAge(found->length) + (found->period ? " every " + FormatAge(*found->period) : "");
}

TEST(Absences, AreToldFromLosses) {
  const struct {
    std::string exchanges;
    std::string says;
  } rows[] = {
      {Times(30, "o"), ""},
      {Times(30, "x"), ""},
      {Times(30, "o") + "x", ""},
      {Times(30, "o") + "xxo", ""},
      {Times(30, "o") + "xxxxo", "4.0 s"},
      {Times(30, "o") + "xxxx", ""},  // nobody knows whether it comes back
      {Times(4, "oooooooooooooxxx") + "o", "3.0 s every 16 s"},
      {Times(4, "oooooxxxxx") + "o", "5.0 s every 10 s"},
      {"ooooooxxxxxooooooooxxxoooooooooooooooooooxxxxoooooo", "4.0 s"},
      {"x" + Times(40, "o") + "xxxxxooo", "5.0 s"},
      {Times(20, "o") + "x" + Times(20, "o") + "xxxxxooo", "5.0 s"},
      // As chance or a rule has it, whatever their number.
      {Times(16, "oox"), ""},
      {Times(16, "oxx"), ""},
      {Times(16, "ox"), ""},
      // One outage among losses.
      {Times(30, "o") + "xxxxxxxx" + Times(6, "oooox") + "o", ""},
  };
  for (const auto& row : rows) EXPECT_EQ(Shown(After(row.exchanges)), row.says) << row.exchanges;
}

TEST(Absences, ChanceIsNone) {
  std::mt19937 random(1);
  int wrong = 0;
  for (int i = 0; i < 2000; ++i) {
    std::bernoulli_distribution fails(0.1 + 0.06 * (i % 10));
    std::string exchanges;
    for (int j = 0; j < 100; ++j) exchanges += fails(random) ? 'x' : 'o';
    wrong += FindAbsences(After(exchanges)).has_value() ? 1 : 0;
  }
  EXPECT_LE(wrong, 4) << "of 2000";
}

TEST(Absences, OfTwoDevicesAtTheSameTime) {
  const struct {
    std::string one;
    std::string other;
    bool together;
  } rows[] = {
      {"ooooxxxooooxxxoooo", "oooooxxooooxxxxooo", true},
      {"ooooxxxooooxxxoooo", "oooooxxooooooooooo", false},  // once may be chance
      {"ooooxxxooooxxxoooo", "oxxoooooxxooooooxx", false},
      {"oooxoooooxoooooxoo", "oooxoooooxoooooxoo", false},  // single losses
      {"ooooxxxooooxxxoooo", "oooxxxxxxxxxxxxxoo", false},  // the other one was away all the time
  };
  for (const auto& row : rows) {
    EXPECT_EQ(AreAwayTogether(After(row.one), After(row.other)), row.together) << row.other;
  }
}

bool FailTogether(const FailureRuns& one, const FailureRuns& other) {
  return CoincidencesOf(one, other).AreNoChance();
}

TEST(Absences, SingleLossesOfTwoAtTheSameTime) {
  const std::string seldom = Times(6, "ooooooooxooo") + "o";
  EXPECT_TRUE(FailTogether(After(seldom), After(seldom)));
  EXPECT_FALSE(FailTogether(After(seldom), After("oooo" + seldom)));
  EXPECT_FALSE(FailTogether(After(seldom), After(Times(36, "ox") + "o")))
      << "one fails all the time";
  EXPECT_FALSE(FailTogether(After(seldom), After(Times(40, "o"))));
  EXPECT_FALSE(FailTogether(After("ooooxoooo"), After("ooooxoooo"))) << "once may be chance";
}

TEST(Absences, OfManyAFewAreEnough) {
  const FailureRuns few = After("oooooooooxooooooooxooooooooxoooooo");
  EXPECT_FALSE(FailTogether(few, few));
  Coincidences all = CoincidencesOf(few, few);
  all.Add(CoincidencesOf(few, few));
  all.Add(CoincidencesOf(few, few));
  EXPECT_TRUE(all.AreNoChance());
}

TEST(Absences, OutagesThatStrikeNowOneAndNowAnother) {
  const std::string quiet = "oooooooo";
  const std::string fails = "xooooooo";
  const FailureRuns one = After(quiet + fails + quiet + fails + quiet + fails + quiet);
  const FailureRuns other = After(quiet + quiet + fails + quiet + fails + quiet + fails + "o");
  const FailureRuns random = After("oxoooooooooxoooooxooooooooooooooooooooooxoooooooox");
  const auto period = [](std::initializer_list<const FailureRuns*> devices) {
    return SharedPeriod({devices.begin(), devices.size()});
  };
  EXPECT_EQ(period({&one, &other}), 8s);
  EXPECT_EQ(period({&one}), std::nullopt);
  EXPECT_EQ(period({&one, &random}), std::nullopt);
  const FailureRuns always = After(quiet + fails + fails + fails + fails + fails);
  EXPECT_EQ(period({&always, &always}), 8s);
  const FailureRuns once = After(quiet + fails + quiet + quiet + quiet + quiet);
  EXPECT_EQ(period({&always, &once}), std::nullopt) << "they are one device's own";
}

TEST(Absences, RareAndRegularFailuresAreOutages) {
  EXPECT_EQ(Shown(After(Times(5, "ooooooooox") + "o")), "1.0 s every 10 s");
  EXPECT_EQ(Shown(After(Times(4, "ooooooooox") + "o")), "");
}

TEST(Absences, TwoThatFailByChanceAreNotTogether) {
  std::mt19937 random(2);
  int wrong = 0;
  for (int i = 0; i < 2000; ++i) {
    std::bernoulli_distribution fails(0.05 + 0.04 * (i % 10));
    const auto draw = [&] {
      std::string exchanges;
      for (int j = 0; j < 100; ++j) exchanges += fails(random) ? 'x' : 'o';
      return After(exchanges);
    };
    const FailureRuns one = draw();
    const FailureRuns other = draw();
    wrong += FailTogether(one, other) ? 1 : 0;
  }
  EXPECT_LE(wrong, 4) << "of 2000";
}

TEST(Absences, SilenceIsUsualWhereItHasEndedBefore) {
  const struct {
    std::string exchanges;
    bool usual;
  } rows[] = {
      {"oooo", false},
      {"ooooxxx", false},
      {"ooooxxxooooxxx", false},  // once is no habit
      {"ooooxxxooooxxxooooxxxx", true},
      {"ooooxxxooooxxxooooxxxxxxxxxxxx", false},
      {"ooooxxxooooxxxoooo", false},  // it answers
  };
  for (const auto& row : rows) {
    const Instant now = kStart + std::chrono::seconds(row.exchanges.size());
    EXPECT_EQ(IsUsualSilence(After(row.exchanges), now), row.usual) << row.exchanges;
  }
}

}  // namespace
}  // namespace baudgate::control
