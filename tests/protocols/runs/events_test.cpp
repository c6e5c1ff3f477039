// Every event that a relay raises is in the file exactly once and in order, at the time when it was
// raised: over a line that damages and loses requests and replies, kills of the program, and power
// cuts that keep of the disk what was synced. The relays forget what the next L confirms.
// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include "tests/protocols/runs/event_keeper.h"
#include "tests/protocols/runs/mishaps.h"
#include "tests/protocols/runs/rig.h"
#include "tests/support/long_run.h"

namespace baudgate {
namespace {

using events::EventRecord;

struct Raised {
  std::uint32_t code = 0;
  WallTime time{};
};

class RelayStation {
 public:
  RelayStation(unsigned seed, Troubles troubles)
      : mishaps_(seed, troubles),
        rig_(RealLine("Spa9600"),
             [](config::Line& line) {
               for (config::Device& device : line.devices) device.events = true;
             }),
        keeper_({NameOf(0), NameOf(1)}),
        raised_(rig_.devices()) {
    rig_->keep_sent = false;
    rig_->keep = [this](const ReportedEvents& reported) {
      return keeper_.Keep(reported, rig_.device(reported.device));
    };
    for (std::uint32_t i = 0; i < rig_.devices(); ++i) SpoilWire(rig_->twin(i).manner);
    Begin();
    rig_->Open();
  }

  void RunFor(Duration time) {
    const Duration until = rig_->elapsed() + time;
    while (rig_->elapsed() < until) {
      rig_->RunFor(std::chrono::milliseconds(1 + mishaps_.Below(3000)));
      if (mishaps_.Below(3) == 0) Raise();
      if (keeper_.power_failed() || mishaps_.Kills(40)) Restart();
    }
  }

  /// In peace, until all is told.
  void End() {
    mishaps_.End();
    Restart();
    rig_->RunFor(2min);
  }

  /// All that is in the file: without a gap, and of each device what it has raised, in order.
  void Check() {
    std::vector<std::vector<EventRecord>> kept(rig_.devices());
    for (const EventRecord& record : keeper_.ReadAll()) {
      for (std::uint32_t i = 0; i < rig_.devices(); ++i) {
        if (record.device == NameOf(i)) kept[i].push_back(record);
      }
    }
    for (std::uint32_t i = 0; i < rig_.devices(); ++i) CheckDevice(raised_[i], kept[i]);
    repeats += keeper_.repeats();
    asked_again = keeper_.asked_again;
  }

  std::size_t raised() const { return serial_; }
  std::size_t restarts = 0;
  std::size_t asked_again = 0;  ///< batches that B has brought
  std::uint64_t repeats = 0;    ///< events of those that had been kept
  std::size_t guessed = 0;      ///< times whose minute could not be known

 private:
  std::string NameOf(std::uint32_t device) { return rig_.device(device).name; }

  void SpoilWire(Manner& manner) {
    manner.distort = [this, &manner](Bytes reply) {
      manner.dead = false;
      return mishaps_.Carry(std::move(reply));
    };
  }

  /// Bursts of up to a dozen, at most what the register holds.
  void Raise() {
    const auto device = mishaps_.Below(rig_.devices());
    for (std::size_t i = 0; i <= mishaps_.Below(12); ++i) {
      const DeviceEvent event{device, ++serial_, {}, {}};
      ASSERT_TRUE(rig_->twin(device).twin->Raise(event, rig_->now()));
      raised_[device].push_back({serial_, rig_->now().wall});
    }
    // A request that does not arrive.
    rig_->twin(device).manner.dead = mishaps_.StrikesWire();
    if (rig_->twin(device).manner.dead) {
      rig_->RunFor(300ms);
      rig_->twin(device).manner.dead = false;
    }
  }

  void Begin() { keeper_.Begin(mishaps_.PowerLeft(400)); }
  void Restart() {
    ++restarts;
    repeats += keeper_.repeats();
    keeper_.End(mishaps_.random());
    Begin();
    rig_->Restart();
  }

  void CheckDevice(const std::vector<Raised>& raised, const std::vector<EventRecord>& kept) {
    ASSERT_EQ(kept.size(), raised.size()) << "lost or doubled";
    for (std::size_t i = 0; i < kept.size(); ++i) {
      ASSERT_EQ(kept[i].code, raised[i].code) << "in order";
      if (kept[i].clock == events::ClockQuality::minute_guessed) ++guessed;
      const Duration away = kept[i].device_time - raised[i].time;
      ASSERT_LE(std::chrono::abs(away), 5ms) << Name(kept[i].clock) << " event " << i;
    }
  }

  Mishaps mishaps_;
  Rig rig_;
  EventKeeper keeper_;
  std::uint32_t serial_ = 0;
  std::vector<std::vector<Raised>> raised_;
};

TEST(SpaEvents, ComeOnceAndInOrderOverAGoodLine) {
  RelayStation station(1, {});
  station.RunFor(10min);
  station.End();
  station.Check();
  EXPECT_GT(station.raised(), 300U);
  EXPECT_LT(station.guessed, station.raised() / 20)
      << "only what came before the first empty reply";
}

TEST(SpaEvents, ComeOnceAndInOrderOverABadLine) {
  const std::size_t seeds = LongRun(6);
  std::size_t asked_again = 0;
  for (unsigned seed = 1; seed <= seeds && !::testing::Test::HasFailure(); ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    RelayStation station(seed, {.wire_one_in = seed % 2 != 0 ? 20U : 100U});
    station.RunFor(15min);
    station.End();
    station.Check();
    asked_again += station.asked_again;
  }
  EXPECT_GT(asked_again, 3 * seeds) << "no reply was lost";
}

TEST(SpaEvents, OutliveKillsAndPowerCutsOverABadLine) {
  const std::size_t seeds = LongRun(40);
  std::size_t restarts = 0;
  std::uint64_t repeats = 0;
  for (unsigned seed = 1; seed <= seeds && !::testing::Test::HasFailure(); ++seed) {
    SCOPED_TRACE("seed " + std::to_string(seed));
    RelayStation station(seed, {.wire_one_in = 100, .kills = seed % 2 != 0, .power_cuts = true});
    station.RunFor(10min);
    station.End();
    station.Check();
    restarts += station.restarts;
    repeats += station.repeats;
  }
  EXPECT_GT(restarts, 5 * seeds);
  EXPECT_GT(repeats, 0U) << "nothing came once more";
}

}  // namespace
}  // namespace baudgate
