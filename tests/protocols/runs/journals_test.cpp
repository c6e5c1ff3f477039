// Every record of a meter's journals is in the file exactly once, in the order of its journal and
// at the time of the meter's clock: over a line that damages and loses, replies that come late,
// kills of the program and power cuts. The meters forget only what ten records later takes the
// place of.
// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <map>

#include "tests/protocols/runs/event_keeper.h"
#include "tests/protocols/runs/mishaps.h"
#include "tests/protocols/runs/rig.h"
#include "tests/support/long_run.h"

namespace baudgate {
namespace {

using events::EventRecord;

/// The events of one journal: code and second, in the order in which they happened.
using Told = std::vector<std::pair<std::uint32_t, std::int64_t>>;
/// By the number of the journal.
using History = std::map<std::uint32_t, Told>;

class Meters {
 public:
  Meters(unsigned seed, Troubles troubles)
      : mishaps_(seed, troubles),
        rig_(RealLine("Set4tm9600"),
             [](config::Line& line) {
               line.options.Set("time_zone", std::string("+03:00"));
               for (config::Device& device : line.devices) {
                 device.events = true;
                 device.options.Set("time_zone", std::string("+03:00"));
                 // What else it is asked is others' business.
                 device.points.resize(30);
               }
             }),
        keeper_({rig_.device(0).name, rig_.device(1).name}),
        raised_(rig_.devices()) {
    rig_->keep_sent = false;
    rig_->said = [this](std::uint32_t device) { return keeper_.Said(device); };
    rig_->keep = [this](const ReportedEvents& reported) {
      return keeper_.Keep(reported, rig_.device(reported.device));
    };
    for (std::uint32_t i = 0; i < rig_.devices(); ++i) SpoilWire(rig_->twin(i).manner);
    Begin();
    rig_->Restart();
  }

  void RunFor(Duration time) {
    const Duration until = rig_->elapsed() + time;
    while (rig_->elapsed() < until) {
      rig_->RunFor(std::chrono::milliseconds(1 + mishaps_.Below(60'000)));
      if (mishaps_.Below(2) == 0) Raise();
      if (keeper_.power_failed() || mishaps_.Kills(10)) Restart();
    }
  }

  /// Nobody asks the meters meanwhile.
  void Sleep(int events) {
    rig_->Close();
    for (int i = 0; i < events; ++i) {
      rig_->RunFor(1min);
      Happen(0, 51);
    }
    Restart();
  }

  /// In peace, until all is told.
  void End() {
    mishaps_.End();
    Restart();
    rig_->RunFor(10min);
  }

  void Check() {
    std::vector<History> kept(rig_.devices());
    for (const EventRecord& record : keeper_.ReadAll()) {
      const std::uint32_t device = record.device == rig_.device(0).name ? 0 : 1;
      if (record.code % 10 == 9) {
        gaps.push_back(record.text);
        continue;
      }
      ASSERT_EQ(record.clock, events::ClockQuality::device) << record.text;
      kept[device][record.code / 10].emplace_back(record.code,
                                                  record.device_time.time_since_epoch() / 1s);
      ++told;
    }
    if (!gaps.empty()) return;
    ASSERT_EQ(kept, raised_);
  }

  std::size_t restarts = 0;
  std::size_t told = 0;
  std::vector<std::string> gaps;

 private:
  void SpoilWire(Manner& manner) {
    manner.distort = [this, &manner](Bytes reply) {
      manner.think = mishaps_.StrikesLate() ? 1s : 20ms;
      return mishaps_.Carry(std::move(reply));
    };
  }

  void Happen(std::uint32_t device, std::uint32_t code) {
    ASSERT_TRUE(rig_->twin(device).twin->Raise({0, code, {}, {}}, rig_->now()));
    raised_[device][code / 10].emplace_back(code, rig_->now().wall.time_since_epoch() / 1s);
  }

  void Raise() {
    const auto device = mishaps_.Below(rig_.devices());
    for (std::size_t i = 0; i <= mishaps_.Below(3); ++i) {
      constexpr std::uint32_t kMoments[] = {22, 51, 61, 601};
      constexpr std::uint32_t kIntervals[] = {11, 71, 81, 91, 101};
      if (mishaps_.Below(3) == 0) {
        Happen(device, kMoments[mishaps_.Below(4)]);
        continue;
      }
      const std::uint32_t code = kIntervals[mishaps_.Below(5)];
      bool& under_way = under_way_[{device, code}];
      Happen(device, under_way ? code + 1 : code);
      under_way = !under_way;
    }
  }

  void Begin() { keeper_.Begin(mishaps_.PowerLeft(400)); }
  void Restart() {
    ++restarts;
    keeper_.End(mishaps_.random());
    Begin();
    rig_->Restart();
  }

  Mishaps mishaps_;
  Rig rig_;
  EventKeeper keeper_;
  std::map<std::pair<std::uint32_t, std::uint32_t>, bool> under_way_;
  std::vector<History> raised_;
};

TEST(MeterJournals, ComeOnceAndInOrderOverAGoodLine) {
  Meters meters(1, {});
  meters.RunFor(1h);
  meters.End();
  meters.Check();
  EXPECT_TRUE(meters.gaps.empty());
  EXPECT_GT(meters.told, 100U);
}

TEST(MeterJournals, ComeOnceOverABadLineWithLateReplies) {
  for (unsigned seed = 1; seed <= LongRun(2) && !::testing::Test::HasFailure(); ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    Meters meters(seed, {.wire_one_in = 30, .late_one_in = seed % 2 != 0 ? 40U : 0U});
    meters.RunFor(40min);
    meters.End();
    meters.Check();
    EXPECT_TRUE(meters.gaps.empty());
  }
}

TEST(MeterJournals, OutliveKillsAndPowerCutsOverABadLine) {
  const std::size_t seeds = LongRun(4);
  std::size_t restarts = 0;
  for (unsigned seed = 1; seed <= seeds && !::testing::Test::HasFailure(); ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    Meters meters(seed, {.wire_one_in = 100, .kills = true, .power_cuts = seed % 2 != 0});
    meters.RunFor(40min);
    meters.End();
    meters.Check();
    EXPECT_TRUE(meters.gaps.empty());
    restarts += meters.restarts;
  }
  EXPECT_GT(restarts, 3 * seeds);
}

TEST(MeterJournals, AJournalThatWentRoundMeanwhileSaysSo) {
  Meters meters(1, {});
  meters.Sleep(10);
  meters.End();
  meters.Sleep(12);
  meters.End();
  meters.Check();
  ASSERT_EQ(meters.gaps.size(), 1U);
  EXPECT_EQ(meters.told, 20U);
}

}  // namespace
}  // namespace baudgate
