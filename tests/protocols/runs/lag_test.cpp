// Random runs behind a lagging server. Each line runs with one query, two queries of one form, or
// many; devices answer, refuse or ignore the request for their name. There are single and mixed
// faults, replaced devices, writes, and restarts of the program. The oracle of birth_oracle.h must
// find no wrong value good; the share of good values is measured as well.
//
//   BAUDGATE_LAG_EXCHANGES=1000000000 runs_test --gtest_filter='*RandomLag*'     a long run
//   BAUDGATE_LAG_SEED=17 runs_test --gtest_filter='*RandomLag*/Spa9600OneAnswered'     repeats
//                                                                                      one run
//
// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <array>
#include <cstdio>
#include <random>
#include <string>
#include <string_view>

#include "gateway/base/text.h"
#include "tests/protocols/runs/lag_rig.h"
#include "tests/protocols/runs/lag_troubles.h"
#include "tests/protocols/runs/lagging_server.h"
#include "tests/support/long_run.h"
#include "tests/support/times.h"

namespace baudgate::protocols {
namespace {

constexpr std::size_t kExchanges = 1'000'000;
constexpr int kToldFailures = 3;
constexpr std::size_t kRecoveries = 14;

/// Each line begins with another seed. So all troubles occur although each line makes a few runs
/// only.
std::size_t FirstSeed(const LagCase& which) {
  const auto is_it = [&](const LagCase& one) { return one.name() == which.name(); };
  const std::vector<LagCase> all = LagCases();
  return static_cast<std::size_t>(std::ranges::find_if(all, is_it) - all.begin()) + 1;
}

/// A copied reply that is mistaken for the next reply delays all replies by one request, until the
/// line is idle or a probe follows (docs/timeouts.md, "The limit").
constexpr Duration kUntilTheNextProbe = 65s;

/// One run: half a minute undisturbed, a few minutes of trouble, half a minute undisturbed.
class RandomRun {
 public:
  RandomRun(const LagCase& which, unsigned seed)
      : rig(which, seed),
        random_(seed),
        trouble_(static_cast<Trouble>(seed % kTroubles)),
        stops_(random_() % 4 == 0),
        replaces_(random_() % 3 == 0) {
    if (!which.CanProve() && IsBeyondProof(trouble_)) trouble_ = Trouble::lost;
    if (IsCopied(trouble_)) {
      rig.oracle().grace = kUntilTheNextProbe;
      replaces_ = false;
      stops_ = false;
    }
    if (random_() % 2 == 0) rig.silent_after_write = 1400ms;
  }

  void Run() {
    rig.Open();
    Live(10 + random_() % 20);
    rig.Suffer(trouble_);
    const std::size_t troubled = 60 + random_() % 120;
    const std::size_t replaced = random_() % troubled;
    Live(replaced);
    if (replaces_) {
      const Duration off = 500ms + std::chrono::milliseconds(random_() % 4000);
      rig.Replace(static_cast<std::uint32_t>(random_() % rig.devices()), off, random_() % 2 == 0);
    }
    Live(troubled - replaced);
    rig.server().faults = {};
    Live(30);
  }

  std::string Told() const {
    std::string told(Name(trouble_));
    if (replaces_) told += ", a device replaced";
    if (stops_) told += ", the program stopped now and then";
    return told;
  }
  Trouble trouble() const { return trouble_; }

  LagRig rig;

 private:
  void Live(std::size_t seconds) {
    for (std::size_t i = 0; i < seconds; ++i) {
      rig.RunFor(std::chrono::milliseconds(500 + random_() % 1000));
      if (random_() % 10 == 0) rig.Write(static_cast<std::uint32_t>(random_() % rig.devices()));
      if (!stops_ || random_() % 8 != 0) continue;
      const Duration stop = std::chrono::milliseconds(50 + random_() % 5000);
      rig->Stop(stop, random_() % 2 == 0);
    }
  }

  std::mt19937 random_;
  Trouble trouble_;
  bool stops_;
  bool replaces_;
};

class RandomLag : public ::testing::TestWithParam<LagCase> {};

TEST_P(RandomLag, NoWrongValueIsEverGood) {
  const std::size_t one = Setting("BAUDGATE_LAG_SEED", 0);
  const std::size_t exchanges =
      Setting("BAUDGATE_LAG_EXCHANGES", LongRun(kExchanges)) / LagCases().size();
  std::size_t done = 0;
  std::size_t judged = 0;
  std::size_t excused = 0;
  std::size_t runs = 0;
  std::size_t wrong_runs[kTroubles] = {};
  int failures = 0;
  for (std::size_t seed = one == 0 ? FirstSeed(GetParam()) : one; done < exchanges; ++seed) {
    RandomRun run(GetParam(), static_cast<unsigned>(seed));
    run.Run();
    ++runs;
    done += run.rig.requests();
    judged += run.rig.oracle().judged();
    excused += run.rig.oracle().excused();
    if (run.rig.oracle().wrong() > 0) {
      ++wrong_runs[static_cast<std::size_t>(run.trouble())];
      if (++failures <= kToldFailures) {
        ADD_FAILURE() << GetParam().name() << ", seed " << seed << " (" << run.Told()
                      << "): " << run.rig.oracle().wrong() << " wrong readings were good; "
                      << run.rig.oracle().what();
      }
    }
    if (one != 0) break;
  }
  EXPECT_EQ(failures, 0);
  std::string where;
  for (std::size_t i = 0; i < kTroubles; ++i) {
    if (wrong_runs[i] == 0) continue;
    where += where.empty() ? "; wrong: " : ", ";
    where += std::string(Name(static_cast<Trouble>(i))) + " " + std::to_string(wrong_runs[i]);
  }
  std::printf("%s: %zu runs, %zu exchanges, %zu good readings judged, %zu excused%s\n",
              GetParam().name().c_str(), runs, done, judged, excused, where.c_str());
}

TEST_P(RandomLag, AllPointsRecoverAfterwards) {
  const std::size_t first = FirstSeed(GetParam());
  const std::size_t runs = Setting("BAUDGATE_LAG_RUNS", LongRun(kRecoveries));
  for (std::size_t seed = first; seed < first + runs; ++seed) {
    RandomRun run(GetParam(), static_cast<unsigned>(seed));
    run.Run();
    for (std::uint32_t device = 0; device < run.rig.devices(); ++device) {
      if (run.rig.IsForeign(device)) run.rig.Replace(device, 500ms, false);
    }
    run.rig.RunFor(2min);
    EXPECT_TRUE(run.rig.AllGood()) << "seed " << seed << " (" << run.Told() << ")";
  }
}

INSTANTIATE_TEST_SUITE_P(Lines, RandomLag, ::testing::ValuesIn(LagCases()), LagCaseName);

double ShareOfGood(const LagCase& which, const ServerFaults& faults, Duration time) {
  LagRig rig(which, 1);
  rig.Open();
  rig.RunFor(20s);
  rig.server().faults = faults;
  rig.oracle().RestartAvailability();
  rig.RunFor(time);
  return rig.oracle().Availability();
}

class LagAvailability : public ::testing::TestWithParam<LagCase> {};

TEST_P(LagAvailability, MostReadingsAreGood) {
  constexpr double kToday = 1.0;  // share of good readings without disturbance
  const double undisturbed = ShareOfGood(GetParam(), {}, 10min);
  const double lost = ShareOfGood(GetParam(), {.drop = 100}, 30min);
  std::array<double, 3> behind{};
  for (std::size_t i = 0; i < behind.size(); ++i)
    behind[i] = ShareOfGood(GetParam(), {.behind = i + 1}, 10min);
  std::printf(
      "%-28s undisturbed %6.2f %%  1 in 100 lost %6.2f %%  behind by 1, 2, 3: %6.2f %6.2f %6.2f "
      "%%\n",
      GetParam().name().c_str(), 100 * undisturbed, 100 * lost, 100 * behind[0], 100 * behind[1],
      100 * behind[2]);
  EXPECT_GE(undisturbed, 0.999 * kToday);
  EXPECT_GE(lost, 0.95 * kToday);
  const std::string_view protocol = GetParam().setup.protocol->name;
  if (protocol == "spabus" || protocol.starts_with("modbus")) {
    for (const double share : behind) EXPECT_GE(share, 0.9 * kToday);
  }
  // Without a proof of the order no share is guaranteed.
  if (GetParam().proof != Proof::answered) return;
  for (const double share : behind) EXPECT_GE(share, 0.5 * kToday);
}

TEST_P(LagAvailability, AllPointsAreGoodAgainBehindASynchronousServer) {
  for (const std::size_t behind : {1U, 2U, 3U}) {
    LagRig rig(GetParam(), 1);
    rig.Open();
    rig.RunFor(20s);
    rig.server().faults = {.behind = behind};
    rig.RunFor(3min);
    rig.server().faults = {};
    rig.RunFor(30s);
    rig.oracle().RestartAvailability();
    rig.RunFor(30s);
    EXPECT_GE(rig.oracle().Availability(), 0.99) << behind << " behind";
  }
}

INSTANTIATE_TEST_SUITE_P(Lines, LagAvailability, ::testing::ValuesIn(LagCases()), LagCaseName);

class Queue {
 public:
  explicit Queue(unsigned seed = 1) : server({{}, false, 5ms}, seed) {}

  /// Example: "2+5 3+5" are replies 2 and 3, after 5 ms each. Requests are one second apart.
  std::string Ask(int number, bool answered = true) {
    const Instant at = kStart + number * 1s;
    Bytes reply;
    if (answered) reply = ToBytes(std::to_string(number));
    std::string text;
    for (const tools::TimedPiece& piece : server.OnRequest(ToBytes("?"), std::move(reply), at)) {
      if (!text.empty()) text += ' ';
      text += std::string(AsText(piece.bytes)) + "+" + std::to_string(piece.after / 1ms);
    }
    return text;
  }

  LaggingServer server;
};

TEST(LaggingServer, ForwardsRepliesUnchangedWithoutFaults) {
  Queue queue;
  EXPECT_EQ(queue.Ask(1), "1+5");
  EXPECT_EQ(queue.Ask(2, false), "");
  EXPECT_EQ(queue.Ask(3), "3+5");
}

TEST(LaggingServer, StaysBehindByTheConfiguredNumberOfReplies) {
  Queue queue;
  queue.server.faults.behind = 2;
  EXPECT_EQ(queue.Ask(1), "");
  EXPECT_EQ(queue.Ask(2), "");
  EXPECT_EQ(queue.Ask(3), "1+5");
  EXPECT_EQ(queue.Ask(4, false), "") << "nothing comes in, nothing goes out";
  EXPECT_EQ(queue.Ask(5), "2+5");
}

TEST(LaggingServer, SendsOrDropsPendingRepliesWhenItRecovers) {
  bool at_once = false;
  bool lost = false;
  for (unsigned seed = 1; seed < 20; ++seed) {
    Queue queue(seed);
    queue.server.faults.behind = 1;
    queue.Ask(1);
    queue.server.faults.behind = 0;
    const std::string comes = queue.Ask(2);
    at_once = at_once || comes == "1+5 2+5";
    lost = lost || comes == "2+5";
    EXPECT_TRUE(comes == "1+5 2+5" || comes == "2+5") << comes;
  }
  EXPECT_TRUE(at_once && lost);
}

TEST(LaggingServer, ADelayedReplyDelaysLaterReplies) {
  Queue queue;
  queue.server.faults = {.delay = 1, .longest_delay = 5s, .growing = true};
  EXPECT_EQ(queue.Ask(1), "1+1005");
  EXPECT_EQ(queue.Ask(2), "2+1505");
  queue.server.faults = {};
  EXPECT_EQ(queue.Ask(3), "3+505") << "not before reply 2";
  EXPECT_EQ(queue.Ask(4), "4+5");
}

TEST(LaggingServer, ACopyIsSentAtOnceOrInsteadOfTheNextReply) {
  Queue queue;
  queue.server.faults.copy = 1;
  EXPECT_EQ(queue.Ask(1), "1+5 1+5");
  queue.server.faults.copy_comes = ServerFaults::Copy::in_place;
  EXPECT_EQ(queue.Ask(2), "2+5");
  EXPECT_EQ(queue.Ask(3), "2+5 3+5");
}

TEST(LaggingServer, AReplySetAsideMayBeOvertakenAndExpires) {
  Queue queue;
  queue.server.faults = {.overtake = 1, .aside = 1h};
  EXPECT_EQ(queue.Ask(1), "");
  queue.server.faults.overtake = 0;
  std::string comes;
  for (int number = 2; number < 20; ++number) comes += queue.Ask(number) + " ";
  EXPECT_NE(comes.find("1+5"), std::string::npos) << comes;
  queue.server.faults = {.overtake = 1, .aside = 1500ms};
  EXPECT_EQ(queue.Ask(30), "");
  queue.server.faults.overtake = 0;
  comes.clear();
  for (int number = 40; number < 60; ++number) comes += queue.Ask(number) + " ";
  EXPECT_EQ(comes.find("30+"), std::string::npos) << comes;
}

TEST(LaggingServer, LosesCutsAndDamagesReplies) {
  Queue queue;
  queue.server.faults.drop = 1;
  EXPECT_EQ(queue.Ask(1), "");
  queue.server.faults = {.cut = 1};
  const std::string cut = queue.Ask(1234567);
  EXPECT_EQ(cut.find("1"), 0U) << cut;
  EXPECT_LT(cut.size(), std::string("1234567+5").size()) << cut;
  queue.server.faults = {.damage = 1};
  int damaged = 0;
  for (int number = 1111111; number < 1111121; ++number) {
    damaged += queue.Ask(number) != std::to_string(number) + "+5" ? 1 : 0;
  }
  EXPECT_GE(damaged, 9) << "a bit may be flipped twice";
  EXPECT_EQ(queue.server.counts().spoilt, 11U);
  EXPECT_EQ(queue.server.arrivals().front().intact, ToBytes("1234567"));
}

TEST(LaggingServer, RepeatsItsFaultsForTheSameSeed) {
  const auto run = [](unsigned seed) {
    Queue queue(seed);
    queue.server.faults = {.drop = 5, .delay = 3, .hold = 7, .overtake = 6, .copy = 4};
    std::string all;
    for (int number = 1; number < 200; ++number) all += queue.Ask(number) + "\n";
    return all;
  };
  EXPECT_EQ(run(3), run(3));
  EXPECT_NE(run(3), run(4));
}

}  // namespace
}  // namespace baudgate::protocols
