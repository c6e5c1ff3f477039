// Days of faults in virtual time: damaged and lost replies, absent devices, a bus that echoes,
// damaged echoes. ctest runs six virtual minutes for each line, packaging/soak.sh 24 hours
// (BAUDGATE_SOAK_HOURS). A wrong value is allowed to be good only if damage produced a valid check
// value, which tests/protocols/runs/bad_wire.h recognises.
// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>
#include <malloc.h>

#include <cstdio>
#include <random>

#include "config/devices.h"
#include "tests/protocols/runs/bad_wire.h"
#include "tests/support/long_run.h"

namespace baudgate::protocols {
namespace {

// The heap is allowed to grow by this many bytes from one hour to the next.
constexpr std::size_t kFlat = 256 * 1024;

std::size_t Hours() { return Setting("BAUDGATE_SOAK_HOURS", 1); }

std::size_t Minutes() { return Setting("BAUDGATE_SOAK_HOURS", 0) > 0 ? 60 : LongRun(60); }

/// In ctest an hour has six minutes, but as many outages as a full hour.
Duration OfAnHour(int parts) { return static_cast<std::int64_t>(Minutes()) * 1min / parts; }

std::size_t HeapInUse() { return mallinfo2().uordblks; }

class Soak : public ::testing::TestWithParam<Setup> {
 protected:
  Soak()
      : rig_(GetParam(),
             [this](config::Line& line) {
               line.echo = config::Echo::strip;
               for (config::Device& device : line.devices) {
                 for (config::Point& point : device.points) point.recheck = Rechecks();
               }
             }),
        dead_until_(rig_.devices()),
        dies_at_(rig_.devices()) {}

  static config::Recheck Rechecks() {
    return config::DefaultRecheck(*GetParam().protocol, GetParam().serial);
  }

  Duration Between(Duration least, Duration most) {
    return least + Duration(static_cast<std::int64_t>(
                       random_() % static_cast<std::uint64_t>((most - least).count())));
  }

  void LetTheBusEcho() {
    rig_->echo = [this](View request) {
      Bytes echo(request.begin(), request.end());
      if (random_() % 100 == 0) echo[random_() % echo.size()] ^= 0x08;
      return echo;
    };
  }

  void LetDevicesDieAndReturn() {
    const Instant now = rig_->now().instant;
    for (std::uint32_t device = 0; device < rig_.devices(); ++device) {
      Manner& manner = rig_->twin(device).manner;
      if (manner.dead && now >= dead_until_[device]) {
        manner.dead = false;
        dies_at_[device] = now + Between(OfAnHour(12), OfAnHour(2));
      } else if (!manner.dead && now >= dies_at_[device]) {
        manner.dead = true;
        ++deaths_;
        dead_until_[device] = now + Between(5s, OfAnHour(12));
      }
    }
  }

  void RunOneHour() {
    for (std::size_t minute = 0; minute < Minutes(); ++minute) {
      LetDevicesDieAndReturn();
      const std::uint64_t before = rig_->store().ReadLine(0).exchanges;
      rig_->RunFor(1min);
      ASSERT_GT(rig_->store().ReadLine(0).exchanges, before) << "the line is stuck";
      rig_->warnings.clear();
      rig_->states.clear();
    }
  }

  Rig rig_;
  std::mt19937_64 random_{7};
  std::vector<Instant> dead_until_;
  std::vector<Instant> dies_at_;
  std::size_t deaths_ = 0;
};

TEST_P(Soak, NoWrongValueIsEverGoodAndMemoryDoesNotGrow) {
  rig_.LearnTruth();
  rig_->keep_sent = false;
  rig_->sent.clear();
  LetTheBusEcho();
  for (Instant& at : dies_at_) at = rig_->now().instant + Between(OfAnHour(60), OfAnHour(3));
  BadWire wire(rig_, 3, {.damaged_one_in = 100, .lost_one_in = 100});
  rig_.Watch([&](std::uint32_t device) { return wire.IsBeyondDetection(device); });
  RunOneHour();
  const std::size_t heap = HeapInUse();
  for (std::size_t hour = 1; hour < Hours() && !HasFailure(); ++hour) RunOneHour();
  EXPECT_LT(HeapInUse(), heap + kFlat);

  wire.End();
  rig_->echo = {};
  for (std::uint32_t device = 0; device < rig_.devices(); ++device) {
    rig_->twin(device).manner.dead = false;
  }
  EXPECT_TRUE(rig_->RunUntil([&] { return rig_.AllGood(); }, 10min)) << "some never came back";
  const bus::LineStatus status = rig_->store().ReadLine(0);
  if (Rechecks() != config::Recheck::off) {
    EXPECT_EQ(rig_.wrong(), 0U) << "beyond the jump";
  }
  const bool is_short = Minutes() < 60;
  EXPECT_GT(wire.damaged(), is_short ? 1 : 5 * Minutes() / 6);
  EXPECT_GT(wire.lost(), is_short ? 1 : 5 * Minutes() / 6);
  EXPECT_GT(deaths_, is_short ? 1U : 2U);
  std::printf(
      "%s: %zu min, %llu exchanges, %zu damaged, %zu lost, %zu deaths; wrong as good: %zu, all "
      "of them damage with a good check value: %s\n",
      GetParam().name.c_str(), Hours() * Minutes(),
      static_cast<unsigned long long>(status.exchanges), wire.damaged(), wire.lost(), deaths_,
      rig_.wrong(), HasFailure() ? "NO" : "yes");
}

INSTANTIATE_TEST_SUITE_P(Real, Soak, ::testing::ValuesIn(DamagedLines()), SetupName);

}  // namespace
}  // namespace baudgate::protocols
