// When faults of twins strike: after, for, every, at a rate, repeatable by their seed.
// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <algorithm>
#include <string>

#include "tests/gateway/tools/simulate/twin_faults_fixture.h"

namespace baudgate {
namespace {

TEST(FaultSchedule, BeginsEndsAndRepeats) {
  const Fault always = Parsed("loss");
  EXPECT_TRUE(always.IsDue(0s));
  EXPECT_TRUE(always.IsDue(100h));
  const Fault once = Parsed("loss:after=30s,for=20s");
  for (const auto& [when, due] :
       {std::pair<Duration, bool>{29999ms, false}, {30s, true}, {49999ms, true}, {50s, false}}) {
    EXPECT_EQ(once.IsDue(when), due) << FormatDuration(when);
    EXPECT_EQ(once.IsDue(when + 1h), false);
  }
  const Fault again = Parsed("loss:after=30s,for=20s,every=1min");
  for (const Duration round : {Duration(0s), Duration(1min), Duration(10h)}) {
    EXPECT_FALSE(again.IsDue(29999ms + round)) << FormatDuration(round);
    EXPECT_TRUE(again.IsDue(30s + round));
    EXPECT_TRUE(again.IsDue(49999ms + round));
    EXPECT_FALSE(again.IsDue(50s + round));
  }
}

TEST(FaultSchedule, OutsideOfItRepliesAreWhole) {
  TwinFaults faults = Make({"loss:after=30s,for=20s,every=1min"});
  int lost = 0;
  for (Duration time = 0s; time < 3min; time += 1s) {
    const auto said = Said(faults, time);
    if (said.empty()) ++lost;
    EXPECT_TRUE(said.empty() || said[0] == "15ms 0123456789");
  }
  EXPECT_EQ(lost, 3 * 20);
  EXPECT_EQ(faults.Counts()[0].struck, 60U);
  EXPECT_EQ(faults.Counts()[0].exchanges, 180U);
  EXPECT_EQ(faults.Counts()[0].fault, "loss:after=30s,for=20s,every=1min");
}

std::string Pattern(const std::string& fault, int exchanges) {
  TwinFaults faults = Make({fault});
  std::string pattern;
  for (int i = 0; i < exchanges; ++i) pattern += Said(faults, i * 1s).empty() ? 'x' : '.';
  return pattern;
}

TEST(FaultRate, IsTheShareOfRepliesThatItStrikes) {
  for (const auto& [text, share] : {std::pair("loss:rate=0.25", 0.25), {"loss:rate=0.01", 0.01}}) {
    const std::string pattern = Pattern(text, 10'000);
    const auto struck = static_cast<double>(std::count(pattern.begin(), pattern.end(), 'x'));
    EXPECT_NEAR(struck, share * 10'000, 150) << text;
  }
  EXPECT_EQ(Pattern("loss:rate=0", 50), std::string(50, '.'));
  EXPECT_EQ(Pattern("loss:rate=1", 50), std::string(50, 'x'));
}

TEST(FaultSeed, RepeatsARunOnEveryMachine) {
  EXPECT_EQ(Pattern("loss:rate=0.5", 32), "...xx..xxxxxx.xxxx..xxxx.xx....x");
  EXPECT_EQ(Pattern("loss:rate=0.5,seed=2", 32), ".xx..x......xxxx.....xxx.x...x.x");
  EXPECT_EQ(Pattern("loss:rate=0.5,seed=1", 200), Pattern("loss:rate=0.5", 200));
}

}  // namespace
}  // namespace baudgate
