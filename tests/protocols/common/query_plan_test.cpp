// Tests which points share a request, and how refusals and silence change the requests. In the
// texts, keys are letters and positions are numbers: "fast a0..3" reads positions 0 to 3 of key a.
// SPDX-License-Identifier: Apache-2.0
#include "protocols/common/query_plan.h"

#include <gtest/gtest.h>

#include <functional>
#include <string>
#include <vector>

#include "protocols/common/identification.h"
#include "tests/support/times.h"

namespace baudgate::protocols {
namespace {

using config::Group;
using Plan = QueryPlan<char>;

struct PlaceInQuery {
  const char* at;
  Group group = Group::fast;
};

/// A request has at most five positions, and a hole of at most two positions is read as well.
Plan::Rules Near() {
  return {.may_join = [](const Block<char>& block, const Block<char>& next) {
    return next.begin <= block.end + 2 && next.end - block.begin <= 5;
  }};
}

Plan MakePlan(const std::vector<PlaceInQuery>& places, Plan::Rules rules = Near()) {
  Plan plan(std::move(rules));
  for (std::size_t point = 0; point < places.size(); ++point) {
    const std::string at = places[point].at;
    const auto dots = at.find("..");
    const std::size_t begin = std::stoul(at.substr(1));
    const std::size_t last = dots == std::string::npos ? begin : std::stoul(at.substr(dots + 2));
    plan.Add(places[point].group, point, at[0], begin, last + 1);
  }
  plan.Make();
  return plan;
}

std::string Shown(const Plan& plan) {
  std::string text;
  for (std::size_t query = 0; query < plan.queries().size(); ++query) {
    const Block<char>& block = plan.block(query);
    const Group group = plan.queries()[query].group;
    if (!text.empty()) text += ", ";
    if (group != Group::fast) text += std::string(config::Name(group)) + " ";
    text += block.key + std::to_string(block.begin);
    if (block.size() > 1) text += ".." + std::to_string(block.end - 1);
  }
  return text;
}

TEST(QueryPlan, AdjacentPlacesShareARequest) {
  struct Case {
    const char* what;
    std::vector<PlaceInQuery> places;
    const char* shown;
  };
  for (const Case& c : std::vector<Case>{
           {"nothing", {}, ""},
           {"neighbours, in the order of places", {{"a2"}, {"a0"}, {"a1"}}, "a0..2"},
           {"over a small hole", {{"a0"}, {"a3"}}, "a0..3"},
           {"not over a wide one", {{"a0"}, {"a4"}}, "a0, a4"},
           {"up to the most", {{"a0"}, {"a1"}, {"a2"}, {"a3"}, {"a4"}, {"a5"}}, "a0..4, a5"},
           {"the same place twice", {{"a7"}, {"a7"}}, "a7"},
           {"a part of another", {{"a0..3"}, {"a1"}, {"a2"}}, "a0..3"},
           {"not another key", {{"b0"}, {"a1"}}, "b0, a1"},
           {"nor another group", {{"a0"}, {"a1", Group::slow}, {"a2"}}, "a0..2, slow a1"},
           {"fast before slow before once",
            {{"a0", Group::once}, {"a1", Group::slow}, {"a2"}},
            "a2, slow a1, once a0"}}) {
    EXPECT_EQ(Shown(MakePlan(c.places)), c.shown) << c.what;
  }
}

TEST(QueryPlan, WithoutARuleOnlyEqualPlacesShareARequest) {
  const Plan plan = MakePlan({{"b0"}, {"a0"}, {"b0"}, {"b1"}}, {});
  EXPECT_EQ(Shown(plan), "b0, b1, a0") << "keys as they were added";
  EXPECT_EQ(plan.queries()[0].points, (std::vector<std::size_t>{0, 2}));
}

TEST(QueryPlan, CountsTheDifferentItemsOfABlock) {
  const Plan plan = MakePlan({{"a0"}, {"a0"}, {"a3"}});
  EXPECT_EQ(plan.block(0).items, 2U);
  EXPECT_EQ(plan.block(0).size(), 4U);
}

TEST(QueryPlan, ARefusedBlockIsSplit) {
  struct Case {
    std::vector<PlaceInQuery> places;
    const char* shown;
  };
  for (const Case& c : std::vector<Case>{{{{"a0"}, {"a1"}, {"a3"}, {"a4"}}, "a0..1, a3..4"},
                                         {{{"a0"}, {"a1"}, {"a2"}, {"a3"}}, "a0..1, a2..3"},
                                         {{{"a0"}, {"a1"}, {"a2"}}, "a0, a1..2"},
                                         {{{"a0..1"}, {"a1..2"}, {"a3"}}, "a0..2, a3"}}) {
    Plan plan = MakePlan(c.places);
    ASSERT_EQ(plan.queries().size(), 1U);
    EXPECT_EQ(plan.OnRefused(0, kStart), PlanChange::split);
    EXPECT_EQ(Shown(plan), c.shown);
  }
}

TEST(QueryPlan, SplitsContinueUntilTheBadPointIsAlone) {
  Plan plan = MakePlan({{"a0"}, {"a1"}, {"a2"}, {"a3"}, {"a4"}});
  const auto bad = [&plan] {
    for (std::size_t query = 0; query < plan.queries().size(); ++query) {
      if (plan.block(query).Covers({'a', 3, 4, 1})) return query;
    }
    return plan.queries().size();
  };
  for (int i = 0; i < 3; ++i) EXPECT_EQ(plan.OnRefused(bad(), kStart), PlanChange::split);
  EXPECT_EQ(plan.OnRefused(bad(), kStart), PlanChange::set_apart);
  EXPECT_EQ(Shown(plan), "a0..1, a2, a4, slow a3");
  EXPECT_EQ(plan.OnRefused(bad(), kStart), PlanChange::nothing);
}

TEST(QueryPlan, ARefusedPointIsRequestedRarelyUntilItIsAnswered) {
  Plan plan = MakePlan({{"a0"}, {"a9"}, {"a10", Group::slow}});
  EXPECT_EQ(plan.OnRefused(1, kStart), PlanChange::set_apart);
  EXPECT_EQ(Shown(plan), "a0, slow a10, slow a9") << "not together with what is answered";
  EXPECT_EQ(plan.OnAnswered(1, kStart), PlanChange::nothing);
  EXPECT_EQ(plan.OnAnswered(2, kStart), PlanChange::restored);
  EXPECT_EQ(Shown(plan), "a0, a9, slow a10");
}

TEST(QueryPlan, AnUncertainRefusalCountsAfterThreeTimes) {
  Plan plan = MakePlan({{"a0"}, {"b0"}},
                       {.may_join = {}, .refused = WhenRefused::ask_daily, .refusals = 3});
  plan.OnAnswered(0, kStart);
  for (int i = 0; i < 2; ++i) {
    EXPECT_FALSE(plan.IsLastRefusal(0));
    EXPECT_EQ(plan.OnRefused(0, kStart), PlanChange::nothing)
        << "it was answered: a failure like any other";
  }
  plan.OnAnswered(0, kStart);
  for (int i = 0; i < 2; ++i) plan.OnRefused(0, kStart);
  EXPECT_TRUE(plan.IsLastRefusal(0));
  EXPECT_EQ(plan.OnRefused(0, kStart), PlanChange::set_apart);
  EXPECT_EQ(Shown(plan), "b0, again a0");
  EXPECT_EQ(plan.OnRefused(0, kStart), PlanChange::set_apart)
      << "never answered: at slow intervals";
  EXPECT_EQ(Shown(plan), "slow b0, again a0");
  EXPECT_EQ(plan.OnRefused(0, kStart), PlanChange::nothing);
  EXPECT_EQ(plan.OnRefused(0, kStart), PlanChange::set_apart) << "and daily from the verdict on";
  EXPECT_EQ(Shown(plan), "daily b0, again a0");
  EXPECT_EQ(plan.OnAnswered(0, kStart), PlanChange::restored);
  EXPECT_EQ(Shown(plan), "b0, again a0");
}

/// A point is given up after several refusals. If it were still read daily, the second refusal
/// would come after a day.
TEST(QueryPlan, ARarelyReadPointIsRetriedInTheSlowGroup) {
  const Plan::Rules rules = {
      .may_join = Near().may_join, .refused = WhenRefused::ask_daily, .refusals = 3};
  for (const Group group : {Group::once, Group::daily}) {
    Plan plan = MakePlan({{"a0", group}}, rules);
    EXPECT_EQ(plan.OnRefused(0, kStart), PlanChange::set_apart);
    EXPECT_EQ(Shown(plan), "slow a0");
    EXPECT_EQ(plan.OnRefused(0, kStart), PlanChange::nothing);
    EXPECT_EQ(plan.OnRefused(0, kStart), PlanChange::set_apart);
    EXPECT_EQ(Shown(plan), "daily a0") << "once is for ever";

    plan = MakePlan({{"a0", group}}, rules);
    plan.OnAnswered(0, kStart);
    EXPECT_EQ(plan.OnRefused(0, kStart), PlanChange::set_apart);
    EXPECT_EQ(Shown(plan), "again a0");
    EXPECT_EQ(plan.OnAnswered(0, kStart), PlanChange::restored);
    EXPECT_EQ(plan.queries()[0].group, group);

    plan = MakePlan({{"a0", group}, {"a1", group}}, rules);
    EXPECT_EQ(plan.OnRefused(0, kStart), PlanChange::split);
    EXPECT_EQ(plan.queries()[0].group, group) << "its parts are judged by what is said to them";
    EXPECT_EQ(plan.queries().size(), 2U);
  }
}

TEST(QueryPlan, AnAnsweredProbeShowsThatSilenceIsARefusal) {
  Plan plan = MakePlan({{"a0"}, {"a1"}});
  for (int i = 0; i < 9; ++i) EXPECT_EQ(plan.OnSilent(0, kStart), PlanChange::nothing);
  plan.OnProbed();
  for (int i = 0; i < 2; ++i) EXPECT_EQ(plan.OnSilent(0, kStart), PlanChange::nothing);
  EXPECT_EQ(plan.OnSilent(0, kStart), PlanChange::split);
  plan.OnAnswered(0, kStart);
  EXPECT_TRUE(plan.SilentlyRefused(0).empty());
  EXPECT_EQ(plan.OnSilent(1, kStart), PlanChange::set_apart) << "its part is suspected already";
  ASSERT_EQ(plan.SilentlyRefused(0).size(), 1U);
  EXPECT_EQ(plan.SilentlyRefused(0)[0], 1U);
  plan.OnAnswered(1, kStart);
  EXPECT_TRUE(plan.SilentlyRefused(0).empty());
}

TEST(QueryPlan, OneReplyPerRoundReportsSilentlyRefusedPoints) {
  Plan plan = MakePlan({{"a0"}, {"b0"}, {"c0"}, {"d0"}});
  plan.OnProbed();
  for (int i = 0; i < 3; ++i) plan.OnSilent(3, kStart);
  ASSERT_EQ(Shown(plan), "a0, b0, c0, slow d0");
  EXPECT_EQ(plan.SilentlyRefused(1).size(), 1U) << "the first reply, to whatever query";
  EXPECT_EQ(plan.SilentlyRefused(2).size(), 0U);
  EXPECT_EQ(plan.SilentlyRefused(0).size(), 1U) << "from now on the first query of the plan";
  EXPECT_EQ(plan.SilentlyRefused(1).size(), 0U);
  EXPECT_EQ(plan.SilentlyRefused(0).size(), 1U) << "a reply may have been lost on its way";
}

struct CountedKey {
  int number = 0;
  bool operator==(const CountedKey& other) const {
    ++compared;
    return number == other.number;
  }
  static inline int compared = 0;
};

TEST(QueryPlan, TheCostOfAReplyIsIndependentOfTheDeviceSize) {
  QueryPlan<CountedKey> plan({});
  for (int i = 0; i < 1000; ++i) plan.Add(Group::fast, static_cast<std::size_t>(i), {i});
  plan.Make();
  CountedKey::compared = 0;
  plan.OnAnswered(500, kStart);
  plan.OnHeard(500, kStart);
  plan.OnSilent(500, kStart);
  EXPECT_EQ(CountedKey::compared, 0) << "no other item is looked at";
}

TEST(QueryPlan, ARefusedPlaceIsDroppedWhereTheProtocolDemandsIt) {
  Plan plan = MakePlan({{"a0"}, {"b0"}, {"b0", Group::slow}},
                       {.may_join = {}, .refused = WhenRefused::drop});
  EXPECT_EQ(plan.OnRefused(1, kStart), PlanChange::set_apart);
  EXPECT_EQ(Shown(plan), "a0") << "one refusal speaks for the place in every group";
  plan.OnReconnect();
  EXPECT_EQ(Shown(plan), "a0, b0, slow b0");
}

TEST(QueryPlan, APlaceThatWasAnsweredIsNotDroppedForARefusal) {
  Plan plan = MakePlan({{"a0"}}, {.may_join = {}, .refused = WhenRefused::drop});
  plan.OnAnswered(0, kStart);
  EXPECT_EQ(plan.OnRefused(0, kStart), PlanChange::set_apart);
  EXPECT_EQ(Shown(plan), "again a0");
  EXPECT_FALSE(plan.ForgetRefusals()) << "it is tried soon anyway";
  EXPECT_EQ(Shown(plan), "again a0");
}

TEST(QueryPlan, ARefusalOfAnHourIsRetriedSlowly) {
  for (const Group group : {Group::fast, Group::once}) {
    Plan plan = MakePlan({{"a0", group}}, {.refused = WhenRefused::ask_daily});
    plan.OnAnswered(0, kStart);
    plan.OnHeard(0, kStart);
    plan.OnRefused(0, kStart);
    plan.OnRefused(0, kStart + 1h - 1s);
    EXPECT_EQ(Shown(plan), "again a0");
    plan.OnRefused(0, kStart + 1h);
    EXPECT_EQ(plan.queries()[0].group, group == Group::fast ? Group::slow : group)
        << "daily is only what was never answered";
  }
}

TEST(QueryPlan, ABusyRarePointIsRetriedSoon) {
  Plan plan = MakePlan({{"a0", Group::slow}});
  EXPECT_EQ(plan.OnHeard(0, kStart), PlanChange::nothing) << "it was never answered";
  plan.OnAnswered(0, kStart);
  EXPECT_EQ(plan.OnHeard(0, kStart), PlanChange::set_apart);
  EXPECT_EQ(Shown(plan), "again a0");
  EXPECT_EQ(plan.OnAnswered(0, kStart), PlanChange::restored);
  EXPECT_EQ(Shown(plan), "slow a0");
}

/// A silent request costs a whole timeout, so it is repeated only in the slow group. Silence,
/// unlike a refusal, proves nothing, so the request does not move on to the daily group.
TEST(QueryPlan, ASilentPointMovesToTheSlowGroup) {
  for (const bool proven : {false, true}) {
    Plan plan = MakePlan({{"a0"}, {"b0"}}, {.refused = WhenRefused::ask_daily});
    if (proven) plan.OnAnswered(1, kStart);
    plan.OnReconnect();
    plan.OnAnswered(0, kStart);
    for (int i = 0; i < 3; ++i) plan.OnSilent(1, kStart);
    EXPECT_EQ(Shown(plan), "a0, slow b0") << proven;
  }
}

TEST(QueryPlan, AReconnectForgetsProbesAndRefusals) {
  Plan plan = MakePlan({{"a0"}, {"a1"}});
  plan.OnProbed();
  plan.OnReconnect();
  for (int i = 0; i < 9; ++i) EXPECT_EQ(plan.OnSilent(0, kStart), PlanChange::nothing);
  plan.OnAnswered(0, kStart);
  for (int i = 0; i < 4; ++i) plan.OnRefused(0, kStart);
  plan.OnReconnect();
  EXPECT_EQ(plan.OnRefused(0, kStart), PlanChange::split) << "a row of refusals begins anew";
}

TEST(TryAgain, RetriesBecomeRarerUpToOnceAnHour) {
  TryAgain again;
  EXPECT_FALSE(again.IsDue(kStart + 1h));
  Instant refused = kStart;
  for (const Duration wait : {8s, 16s, 32s, 64s, 128s, 256s, 512s, 1024s, 2048s, 3600s, 3600s}) {
    again.OnRefused(refused);
    again.OnRefused(refused + 1s);
    EXPECT_FALSE(again.IsDue(refused + wait - 1ms)) << wait / 1s;
    EXPECT_TRUE(again.IsDue(refused + wait)) << wait / 1s;
    refused += wait;
  }
  EXPECT_TRUE(again.TakeDue(refused));
  EXPECT_FALSE(again.TakeDue(refused)) << "once";
  again.Forget();
  again.OnRefused(refused);
  EXPECT_TRUE(again.IsDue(refused + 8s)) << "it has worked meanwhile";
}

TEST(QueryPlan, ADoubtfulRefusalIsForgotten) {
  Plan plan = MakePlan({{"a0"}, {"b0"}}, {.may_join = {}, .refused = WhenRefused::drop});
  EXPECT_FALSE(plan.ForgetRefusals()) << "nothing was refused";
  EXPECT_EQ(plan.OnRefused(1, kStart), PlanChange::set_apart);
  EXPECT_TRUE(plan.ForgetRefusals());
  EXPECT_EQ(Shown(plan), "a0, b0");
}

TEST(QueryPlan, ABlockOfAnUnknownFunctionStaysWhole) {
  Plan plan = MakePlan({{"a0"}, {"a1"}});
  EXPECT_EQ(plan.OnRefused(0, kStart, false), PlanChange::set_apart);
  EXPECT_EQ(Shown(plan), "slow a0..1");
  plan.OnReconnect();
  EXPECT_EQ(Shown(plan), "a0..1");
}

TEST(QueryPlan, AReconnectRestoresWholeBlocks) {
  Plan plan = MakePlan({{"a0"}, {"a1"}});
  EXPECT_EQ(plan.OnRefused(0, kStart), PlanChange::split);
  plan.OnReconnect();
  EXPECT_EQ(Shown(plan), "a0..1");
}

/// A silent block costs time, so it is split into its points. If it was ever answered, its silence
/// is temporary, so the points are joined again.
TEST(QueryPlan, ASilentBlockStaysSplitUnlessItWasAnsweredBefore) {
  for (const bool answered : {false, true}) {
    Plan plan = MakePlan({{"a0"}, {"a1"}, {"b0"}});
    if (answered) plan.OnAnswered(0, kStart);
    plan.OnReconnect();
    plan.OnAnswered(1, kStart);
    for (int i = 0; i < 2; ++i) EXPECT_EQ(plan.OnSilent(0, kStart), PlanChange::nothing);
    EXPECT_EQ(plan.OnSilent(0, kStart), PlanChange::split);
    plan.OnReconnect();
    EXPECT_EQ(Shown(plan), answered ? "a0..1, b0" : "a0, a1, b0");
  }
}

/// A simulated device that answers some positions only, and at times no request at all.
class AskedDevice {
 public:
  explicit AskedDevice(Plan& plan) : plan_(plan) {}

  std::function<bool(const Block<char>&)> answers = [](const Block<char>&) { return true; };
  std::size_t RunFor(Duration time) {
    std::size_t requests = 0;
    for (const Instant end = now_ + time; now_ < end; now_ += 1s) {
      Ask(Group::fast, requests);
      const auto passed = (now_ - kStart) / 1s;
      if (passed % 8 == 0) Ask(config::Group::again, requests);
      if (passed % 60 == 0) Ask(Group::slow, requests);
    }
    return requests;
  }

 private:
  void Ask(Group group, std::size_t& requests) {
    std::size_t rest = 200;
    for (std::size_t query = 0; query < plan_.queries().size() && rest > 0; --rest) {
      if (plan_.queries()[query].group != group) {
        ++query;
        continue;
      }
      ++requests;
      const PlanChange change = answers(plan_.block(query)) ? plan_.OnAnswered(query, now_)
                                                            : plan_.OnRefused(query, now_);
      if (change == PlanChange::nothing) ++query;
    }
  }

  Plan& plan_;
  Instant now_ = kStart;
};

std::vector<PlaceInQuery> FortyPlaces(std::vector<std::string>& names) {
  for (int i = 0; i < 40; ++i) names.push_back("a" + std::to_string(i));
  std::vector<PlaceInQuery> places;
  for (const std::string& name : names) places.push_back({name.c_str()});
  return places;
}

Plan::Rules UpToFifty() {
  return {.may_join = [](const Block<char>& block, const Block<char>& next) {
    return next.begin <= block.end + 2 && next.end - block.begin <= 50;
  }};
}

TEST(QueryPlan, ABlockThatWasAnsweredIsSoonRequestedWholeAgain) {
  std::vector<std::string> names;
  Plan plan = MakePlan(FortyPlaces(names), UpToFifty());
  AskedDevice device(plan);
  device.RunFor(5s);
  for (const Duration outage : {1s, 4s, 60s, 600s}) {
    device.answers = [](const Block<char>&) { return false; };
    const auto during = static_cast<double>(device.RunFor(outage));
    EXPECT_LT(during, 40 + 1.5 * static_cast<double>(outage / 1s)) << "it is not asked in parts";
    device.answers = [](const Block<char>&) { return true; };
    device.RunFor(10s);
    EXPECT_EQ(Shown(plan), "a0..39") << "after " << outage / 1s << " s";
    EXPECT_EQ(device.RunFor(60s), 60U);
  }
}

TEST(QueryPlan, PointsMissingAfterAnOutageCostOtherPointsNothing) {
  std::vector<std::string> names;
  Plan plan = MakePlan(FortyPlaces(names), UpToFifty());
  AskedDevice device(plan);
  device.RunFor(5s);
  device.answers = [](const Block<char>&) { return false; };
  device.RunFor(20s);
  const auto without_four = [](const Block<char>& block) {
    for (const std::size_t gone : {0U, 1U, 7U, 23U}) {
      if (block.begin <= gone && gone < block.end) return false;
    }
    return true;
  };
  device.answers = without_four;
  device.RunFor(2min);
  EXPECT_EQ(plan.queries()[0].group, Group::fast);
  std::size_t fast = 0;
  for (const Query& query : plan.queries()) {
    fast += query.group == Group::fast ? query.points.size() : 0;
  }
  EXPECT_EQ(fast, 36U) << Shown(plan);
  const std::size_t minute = device.RunFor(60s);
  EXPECT_LT(minute, 60U * 4 + 100) << "few requests more than the three blocks that are left";
  for (const Duration outage : {30s, 300s}) {
    device.answers = [](const Block<char>&) { return false; };
    device.RunFor(outage);
    device.answers = without_four;
    device.RunFor(10s);
    fast = 0;
    for (const Query& query : plan.queries()) {
      fast += query.group == Group::fast ? query.points.size() : 0;
    }
    EXPECT_EQ(fast, 36U) << "after " << outage / 1s << " s: " << Shown(plan);
  }
  device.RunFor(2h);
  for (const Query& query : plan.queries()) {
    EXPECT_TRUE(query.group == Group::fast || query.group == Group::slow)
        << "after an hour it may be for ever";
  }
}

TEST(QueryPlan, TheThirdSilenceIsARefusalWhileOthersAreAnswered) {
  Plan plan = MakePlan({{"a0"}, {"b0"}});
  for (int i = 0; i < 9; ++i) {
    EXPECT_EQ(plan.OnSilent(1, kStart), PlanChange::nothing) << "the device itself may be gone";
  }
  plan.OnAnswered(0, kStart);
  EXPECT_EQ(plan.OnSilent(1, kStart), PlanChange::nothing);
  EXPECT_EQ(plan.OnSilent(1, kStart), PlanChange::nothing);
  EXPECT_EQ(plan.OnSilent(1, kStart), PlanChange::set_apart);
  EXPECT_EQ(Shown(plan), "a0, slow b0");
  for (int i = 0; i < 9; ++i) {
    EXPECT_EQ(plan.OnSilent(0, kStart), PlanChange::nothing) << "it has been answered: not unknown";
  }
}

TEST(QueryPlan, ASilentBlockIsSplitFirst) {
  Plan plan = MakePlan({{"a0"}, {"a1"}, {"b0"}});
  plan.OnHeard(1, kStart);
  for (int i = 0; i < 2; ++i) EXPECT_EQ(plan.OnSilent(0, kStart), PlanChange::nothing);
  EXPECT_EQ(plan.OnSilent(0, kStart), PlanChange::split);
  EXPECT_EQ(Shown(plan), "a0, a1, b0");
  EXPECT_EQ(plan.OnSilent(1, kStart), PlanChange::set_apart) << "the parts are suspected already";
  EXPECT_EQ(Shown(plan), "a0, b0, slow a1");
}

TEST(QueryPlan, AReconnectResetsTheCountOfSilences) {
  Plan plan = MakePlan({{"a0"}, {"b0"}});
  plan.OnAnswered(0, kStart);
  for (int i = 0; i < 2; ++i) EXPECT_EQ(plan.OnSilent(1, kStart), PlanChange::nothing);
  plan.OnReconnect();
  EXPECT_EQ(plan.OnSilent(1, kStart), PlanChange::nothing);
  EXPECT_EQ(plan.OnSilent(0, kStart), PlanChange::nothing) << "not heard since";
  EXPECT_TRUE(plan.IsProven(0)) << "but it is known to work";
  EXPECT_FALSE(plan.IsProven(1));
}

TEST(QueryPlan, AnUnknownQueryNumberChangesNothing) {
  Plan plan = MakePlan({{"a0"}});
  EXPECT_EQ(plan.OnAnswered(1, kStart), PlanChange::nothing);
  EXPECT_EQ(plan.OnRefused(1, kStart), PlanChange::nothing);
  EXPECT_EQ(plan.OnSilent(1, kStart), PlanChange::nothing);
  plan.OnHeard(1, kStart);
  EXPECT_EQ(Shown(plan), "a0");
}

// ---------------- `ProbeChoice` chooses which request probes a device: "own" is the protocol's
// probe, a number is a read. '!' marks an answered probe.

using Own = ProbeChoice::Own;

struct Probed {
  bool knows_own = false;
  bool knows_reads = false;
};

std::string ProbesOf(ProbeChoice& choice, const Probed& device, int steps, std::size_t reads = 3) {
  std::string text;
  for (int i = 0; i < steps; ++i) {
    const auto read = choice.Next(reads);
    const bool answered = read ? device.knows_reads : device.knows_own;
    text += (text.empty() ? "" : " ") + (read ? std::to_string(*read) : "own");
    if (answered) {
      text += "!";
      choice.OnAnswered(!read);
    } else {
      choice.OnFailed(!read);
    }
  }
  return text;
}

TEST(ProbeChoice, AlternatesBetweenOwnProbeAndReads) {
  struct Case {
    Own own;
    Probed device;
    const char* asked;
  };
  for (const Case& c : std::vector<Case>{
           {Own::identification, {true, true}, "own! own! own! own! own! own! own! own!"},
           {Own::identification, {false, true}, "own 1! own 1! own 1! 0! 0!"},
           {Own::identification, {false, false}, "own 1 own 2 own 0 own 1"},
           {Own::none, {false, true}, "0! 0! 0! 0! 0! 0! 0! 0!"},
           {Own::none, {false, false}, "0 1 0 2 0 0 0 1"},
           {Own::read, {true, true}, "own! own! own! own! own! own! own! own!"},
           {Own::read, {false, true}, "own 1! own 1! own 1! 0! 0!"}}) {
    ProbeChoice choice(c.own);
    EXPECT_EQ(ProbesOf(choice, c.device, 8), c.asked);
  }
}

TEST(ProbeChoice, UsesOnlyTheOwnProbeWithoutReads) {
  ProbeChoice choice(Own::identification);
  EXPECT_EQ(ProbesOf(choice, {}, 4, 0), "own own own own");
}

TEST(ProbeChoice, KeepsTheOwnProbeForAnAbsentDevice) {
  ProbeChoice choice(Own::identification);
  EXPECT_EQ(ProbesOf(choice, {false, false}, 20, 1),
            "own 0 own 0 own 0 own 0 own 0 own 0 own 0 own 0 own 0 own 0");
}

TEST(ProbeChoice, KeepsAnOwnProbeThatWasAnswered) {
  ProbeChoice choice(Own::identification);
  EXPECT_EQ(ProbesOf(choice, {false, true}, 4), "own 1! own 1!");
  EXPECT_EQ(ProbesOf(choice, {true, true}, 1), "own!");
  EXPECT_EQ(ProbesOf(choice, {false, true}, 4), "own 1! own 2!");
}

TEST(ProbeChoice, RetriesTheOwnProbeOnceAfterAReconnect) {
  ProbeChoice choice(Own::identification);
  EXPECT_EQ(ProbesOf(choice, {false, true}, 7), "own 1! own 1! own 1! 0!");
  choice.OnReconnect();
  EXPECT_EQ(ProbesOf(choice, {false, true}, 3), "own 1! 0!");
}

TEST(ProbeChoice, NeverReplacesAnAnsweredOwnRead) {
  ProbeChoice choice(Own::read);
  EXPECT_EQ(ProbesOf(choice, {true, true}, 1), "own!");
  EXPECT_EQ(ProbesOf(choice, {false, true}, 4), "own own own own");
}

TEST(ProbeChoice, RestartsAfterAnAnsweredPoll) {
  ProbeChoice choice(Own::identification);
  EXPECT_EQ(ProbesOf(choice, {}, 1), "own");
  choice.OnPolled();
  EXPECT_EQ(ProbesOf(choice, {}, 1), "own");
}

TEST(ProbeChoice, UsesThePreferredRead) {
  ProbeChoice choice(Own::none);
  EXPECT_EQ(choice.Next(3, 2), 2U);
}

}  // namespace
}  // namespace baudgate::protocols
