// Tests real protocols with the faults of real plants: absent neighbours, late answers, lost
// replies, echo, garbage, babble, a lost port. No wrong value is shown, and everything recovers.
// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <algorithm>
#include <optional>
#include <random>
#include <string>

#include "gateway/base/text.h"
#include "tests/protocols/runs/bad_wire.h"
#include "tests/protocols/runs/rig.h"
#include "tests/support/long_run.h"

namespace baudgate::protocols {
namespace {

class FaultyRun : public ::testing::TestWithParam<Setup> {
 protected:
  FaultyRun() : rig_(GetParam()) {
    rig_.LearnTruth();
    rig_.Watch();
  }

  void Holds(Duration time, const std::function<bool()>& condition, const char* what) {
    const bool broken = rig_->RunUntil([&] { return !condition(); }, time);
    EXPECT_FALSE(broken) << what << " no more after " << FormatDuration(rig_->elapsed());
  }
  void Comes(Duration within, const std::function<bool()>& condition, const char* what) {
    EXPECT_TRUE(rig_->RunUntil(condition, within))
        << what << " not within " << FormatDuration(within);
  }
  void EverythingComesBack() {
    Comes(
        2min, [&] { return rig_.AllGood(); }, "all points good");
    for (std::uint32_t device = 0; device < rig_.devices(); ++device) {
      Comes(
          2min, [&] { return rig_->StatusOf(device).state == bus::DeviceState::online; }, "online");
    }
    EXPECT_EQ(rig_.wrong(), 0U);
  }

  Rig rig_;
};

/// A TCP connection has neither echoes nor noise, so it is left out.
class FaultySerialRun : public FaultyRun {};

TEST_P(FaultyRun, ADeadNeighbourDoesNotAffectTheOtherDevice) {
  rig_->twin(1).manner.dead = true;
  Holds(
      20s, [&] { return rig_.FastUsable(0); }, "the neighbour is usable");
  EXPECT_EQ(rig_->StatusOf(1).state, bus::DeviceState::offline);
  EXPECT_FALSE(rig_.AnyUsable(1));
  EXPECT_EQ(rig_->QualityOf(1, 0), Quality::bad_communication);
  Holds(
      5min, [&] { return rig_.FastGood(0); }, "the neighbour is good");
  EXPECT_TRUE(rig_.AllGood(0));
  EXPECT_EQ(rig_->StatusOf(0).retries, 0U);
  rig_->twin(1).manner.dead = false;
  EverythingComesBack();
}

/// If replies contain the address of the device, its late reply is not waited for.
TEST_P(FaultyRun, AnAbsentNeighbourCostsOnlyItsTimeout) {
  Rig rig(GetParam());
  rig->twin(1).manner.dead = true;
  rig->Open();
  rig->RunFor(20s);
  const config::Timing times = GetParam().protocol->timing(GetParam().serial);
  const bool named = GetParam().protocol->name != "dcon";
  const Duration most = (named ? *times.reply : *times.ceiling) + *times.drain + 1s;
  Duration longest{};
  for (std::size_t i = 1; i < rig->sent.size(); ++i) {
    longest = std::max(longest, rig->sent[i].at - rig->sent[i - 1].at);
  }
  EXPECT_LE(longest, most) << FormatDuration(longest);
  EXPECT_TRUE(rig.FastGood(0));
}

TEST_P(FaultyRun, RetriesCompensateOneLostReplyInEight) {
  std::mt19937 random(5);
  unsigned lost = 0;
  for (std::uint32_t device = 0; device < rig_.devices(); ++device) {
    rig_->twin(device).manner.distort = [&](Bytes reply) {
      if (random() % 8 != 0) return reply;
      ++lost;
      return Bytes();
    };
  }
  constexpr int kLooks = 360;
  std::vector<int> usable(rig_.devices());
  for (int look = 0; look < kLooks; ++look) {
    rig_->RunFor(500ms);
    for (std::uint32_t device = 0; device < rig_.devices(); ++device) {
      usable[device] += rig_.FastUsable(device) ? 1 : 0;
    }
  }
  unsigned missed = 0;
  unsigned retries = 0;
  for (std::uint32_t device = 0; device < rig_.devices(); ++device) {
    const bus::DeviceStatus status = rig_->StatusOf(device);
    missed += status.Count(Outcome::no_reply);
    retries += status.retries;
    EXPECT_NE(status.state, bus::DeviceState::offline);
    EXPECT_GE(usable[device], kLooks * 3 / 4);
  }
  EXPECT_GT(lost, 20U);
  // A device that misses two requests is also asked twice in the other checksum mode, which it
  // ignores.
  EXPECT_NEAR(missed, lost, 4);
  EXPECT_LE(retries, lost);
  EXPECT_GE(retries, lost * 9 / 10);
  for (std::uint32_t device = 0; device < rig_.devices(); ++device)
    rig_->twin(device).manner.distort = {};
  EverythingComesBack();
}

TEST_P(FaultyRun, FragmentsWithPausesBelowTheGapAreAReply) {
  const config::Timing timing = GetParam().protocol->timing(GetParam().serial);
  for (std::uint32_t device = 0; device < rig_.devices(); ++device) {
    rig_->twin(device).manner.fragment = 7;
    rig_->twin(device).manner.pause = *timing.gap / 8;
  }
  rig_->RunFor(2min);
  EXPECT_TRUE(rig_.AllGood());
  EXPECT_EQ(rig_->StatusOf(0).retries, 0U);
  EXPECT_EQ(rig_->StatusOf(0).Count(Outcome::ok), rig_->StatusOf(0).exchanges);
}

TEST_P(FaultySerialRun, ABabblingDeviceGoesOfflineAndTheOtherRecovers) {
  rig_->twin(0).manner.babble = 20s;
  Comes(
      10min, [&] { return rig_->StatusOf(0).state == bus::DeviceState::offline; }, "offline");
  EXPECT_FALSE(rig_.AnyUsable(0));
  rig_->twin(0).manner.babble = {};
  // A probe costs the neighbour the ceiling and the drain (config::Timing). Probes get 2 % of the
  // line's time.
  Comes(
      5min, [&] { return rig_->StatusOf(0).state == bus::DeviceState::online; }, "online");
  EverythingComesBack();
}

TEST_P(FaultyRun, ALostPortInvalidatesAllValuesUntilItReturns) {
  for (int round = 0; round < 3; ++round) {
    rig_->RunFor(round * 37ms);
    const std::size_t sent = rig_->sent.size();
    rig_->Close();
    for (std::uint32_t device = 0; device < rig_.devices(); ++device) {
      EXPECT_FALSE(rig_.AnyUsable(device));
      EXPECT_EQ(rig_->QualityOf(device, 0), Quality::bad_not_connected);
      EXPECT_EQ(rig_->StatusOf(device).last_outcome, Outcome::line_down);
    }
    rig_->RunFor(30s);
    EXPECT_EQ(rig_->sent.size(), sent) << "nothing is sent to a closed port";
    rig_->Open();
    EXPECT_FALSE(rig_.FastGood(0)) << "what was read before the port was lost is too old";
    EverythingComesBack();
  }
}

TEST_P(FaultyRun, ADeviceSwitchedOffAndOnRecovers) {
  for (std::uint32_t device = 0; device < rig_.devices(); ++device)
    rig_->twin(device).manner.dead = true;
  rig_->RunFor(10min);
  for (std::uint32_t device = 0; device < rig_.devices(); ++device) {
    EXPECT_EQ(rig_->StatusOf(device).state, bus::DeviceState::offline);
    EXPECT_FALSE(rig_.AnyUsable(device));
    rig_->twin(device).manner.dead = false;
  }
  EverythingComesBack();
}

INSTANTIATE_TEST_SUITE_P(Real, FaultyRun, ::testing::ValuesIn(RealLines()), SetupName);
INSTANTIATE_TEST_SUITE_P(Network, FaultyRun, ::testing::Values(TcpLine()), SetupName);
INSTANTIATE_TEST_SUITE_P(Real, FaultySerialRun, ::testing::ValuesIn(RealLines()), SetupName);

/// Replies come late, up to the ceiling (the timeout of the whole exchange). Then they come in time
/// again.
class LateRun : public ::testing::TestWithParam<Setup> {};

struct Lateness {
  Duration reply;
  /// A reply that begins later than this ends after the ceiling, and can be mistaken for the reply
  /// to another request.
  Duration most;
};

Lateness LatenessOf(const config::Device& device, const Setup& setup) {
  constexpr int kLongest = 100;  // longest reply, in characters
  const config::Timing timing = Merge(device.timing, setup.protocol->timing(setup.serial));
  const Duration ceiling = std::max<Duration>(*timing.ceiling, *timing.reply + *timing.gap);
  return {*timing.reply, ceiling - kLongest * setup.serial.CharacterTime()};
}

TEST_P(LateRun, ALateReplyIsNeverTakenForAnother) {
  constexpr int kSteps = 12;
  for (int step = 0; step < kSteps; ++step) {
    Rig rig(GetParam());
    rig.LearnTruth();
    rig.Watch();
    const Lateness lateness = LatenessOf(rig.device(0), GetParam());
    const Duration late = lateness.reply + (lateness.most - lateness.reply) * step / (kSteps - 1);
    for (std::uint32_t device = 0; device < rig.devices(); ++device)
      rig->twin(device).manner.think = late;
    rig->RunFor(1min);
    EXPECT_EQ(rig.wrong(), 0U) << "late by " << FormatDuration(late);
    EXPECT_GT(rig->StatusOf(0).Count(Outcome::no_reply), 0U);
    for (std::uint32_t device = 0; device < rig.devices(); ++device)
      rig->twin(device).manner.think = 5ms;
    EXPECT_TRUE(rig->RunUntil([&] { return rig.AllGood(); }, 15min))
        << "late by " << FormatDuration(late);
    EXPECT_EQ(rig.wrong(), 0U) << "late by " << FormatDuration(late);
    if (HasFailure()) return;
  }
}

class MoodyDevice {
 public:
  MoodyDevice(Rig& rig, std::uint32_t device, Duration late, std::mt19937& random)
      : rig_(rig), late_(late), random_(random), manner_(rig->twin(device).manner) {
    manner_.instead = [this](View request) -> std::optional<Bytes> {
      asked_until_ = rig_->now().instant + TimeOf(request);
      return std::nullopt;
    };
    manner_.distort = [this](Bytes reply) {
      const Duration think = random_() % 6 == 0 ? late_ : Duration(5ms);
      const Instant begin = std::max(asked_until_ + think, said_until_);
      manner_.think = begin - asked_until_;
      said_until_ = begin + TimeOf(reply);
      return reply;
    };
  }

 private:
  Duration TimeOf(View bytes) const {
    return static_cast<std::int64_t>(bytes.size()) * rig_.setup().serial.CharacterTime();
  }

  Rig& rig_;
  Duration late_;
  std::mt19937& random_;
  Manner& manner_;
  Instant asked_until_{};
  Instant said_until_{};
};

void RunMoody(const Setup& setup, bool both) {
  const auto steps = static_cast<int>(LongRun(30));
  for (int step = 1; step <= steps; ++step) {
    std::mt19937 random(static_cast<unsigned>(step));
    Rig rig(setup);
    rig.LearnTruth();
    rig.Watch();
    const Duration late = LatenessOf(rig.device(0), setup).most * step / steps;
    MoodyDevice first(rig, 0, late, random);
    std::optional<MoodyDevice> second;
    if (both) second.emplace(rig, 1, late, random);
    rig->RunFor(3min);
    EXPECT_EQ(rig.wrong(), 0U) << "late by " << FormatDuration(late);
    EXPECT_GT(rig->StatusOf(0).Count(Outcome::ok), 20U);
    if (!both) {
      EXPECT_EQ(rig->StatusOf(1).Count(Outcome::no_reply), 0U) << "the neighbour is in time";
    }
    if (::testing::Test::HasFailure()) return;
  }
}

TEST_P(LateRun, ALateReplyAmongPunctualOnesIsNeverTakenForAnother) { RunMoody(GetParam(), false); }

TEST_P(LateRun, LateRepliesOfTwoDevicesAreNeverTakenForOthers) { RunMoody(GetParam(), true); }

/// The worst case of late replies: two modules with eight queries each, whose replies are numbers
/// without an address.
Setup SingleChannels() {
  Setup setup = RealLine("Dcon115200");
  setup.name = "DconSingleChannels";
  return setup;
}

INSTANTIATE_TEST_SUITE_P(Real, LateRun, ::testing::ValuesIn(RealLines()), SetupName);
INSTANTIATE_TEST_SUITE_P(Network, LateRun, ::testing::Values(TcpLine()), SetupName);

TEST(LateSingleChannels, UntaggedNumbersAreNeverMixedUp) {
  for (int step = 1; step <= 20; ++step) {
    Rig rig(SingleChannels(), [](config::Line& line) {
      for (config::Device& device : line.devices) {
        device.trust_order = true;
        for (std::size_t i = 0; i < device.points.size(); ++i)
          device.points[i].read = "#" + std::to_string(i);
      }
    });
    rig.LearnTruth();
    rig.Watch();
    const Duration late = step * 52ms;
    for (std::uint32_t device = 0; device < rig.devices(); ++device)
      rig->twin(device).manner.think = late;
    rig->RunFor(1min);
    EXPECT_EQ(rig.wrong(), 0U) << "late by " << FormatDuration(late);
    rig->twin(0).manner.think = rig->twin(1).manner.think = 5ms;
    EXPECT_TRUE(rig->RunUntil([&] { return rig.AllGood(); }, 3min));
    EXPECT_EQ(rig.wrong(), 0U) << "late by " << FormatDuration(late);
    if (::testing::Test::HasFailure()) return;
  }
}

// ---------------- Real protocols on a bad wire. A wrong value is allowed to be good only if the
// damage produced a valid check value, which no receiver could detect.

/// Returns how many of the damaged replies are allowed to remain undetected.
std::size_t MostUndetected(const Setup& setup, std::size_t damaged) {
  if (setup.serial.parity == config::Parity::none) return damaged / 64;
  // A parity error is received as 0xFF. In 7-bit text 0xFF never occurs; in a binary protocol it is
  // an ordinary byte.
  return setup.serial.data_bits == 7 ? 0 : damaged / 1000;
}

class DamagedRun : public ::testing::TestWithParam<Setup> {
 protected:
  void Run(unsigned seed) {
    constexpr std::size_t kReplies = 2400;
    Rig rig(GetParam(), [](config::Line& line) {
      for (config::Device& device : line.devices) device.poll = 10ms;
    });
    rig.LearnTruth();
    BadWire wire(rig, seed);
    rig.Watch([&](std::uint32_t device) { return wire.IsBeyondDetection(device); });
    EXPECT_TRUE(rig->RunUntil([&] { return wire.replies() >= kReplies; }, 4h));
    wire.End();
    EXPECT_GT(wire.damaged(), kReplies / 4);
    damaged_ += wire.damaged();
    undetected_ += wire.undetected();
    for (std::uint32_t device = 0; device < rig.devices(); ++device) {
      EXPECT_GT(rig->StatusOf(device).Count(Outcome::corrupt), 40U);
      EXPECT_GT(rig->StatusOf(device).Count(Outcome::ok), 280U);
    }
    EXPECT_TRUE(rig->RunUntil([&] { return rig.AllGood(); }, 10min));
    const std::size_t wrong = rig.wrong();
    rig->RunFor(2min);
    EXPECT_TRUE(rig->RunUntil([&] { return rig.AllGood(); }, 10s));
    EXPECT_EQ(rig.wrong(), wrong);
    EXPECT_EQ(rig->StatusOf(0).state, bus::DeviceState::online);
  }

  std::size_t damaged_ = 0;
  std::size_t undetected_ = 0;
};

TEST_P(DamagedRun, NoWrongValueBecomesGood) {
  for (unsigned seed = 1; seed <= LongRun(10); ++seed) {
    Run(seed);
    if (HasFailure()) FAIL() << "seed " << seed;
  }
  RecordProperty("damaged", static_cast<int>(damaged_));
  RecordProperty("undetected", static_cast<int>(undetected_));
  EXPECT_LE(undetected_, MostUndetected(GetParam(), damaged_));
}

INSTANTIATE_TEST_SUITE_P(Real, DamagedRun, ::testing::ValuesIn(DamagedLines()), SetupName);

/// A wrong value is excused if its check value is valid, so the test computes check values itself.
TEST(DamageOracle, DistinguishesGoodAndBadCheckValues) {
  const auto spa = RealLine("Spa9600").good_checksum;
  EXPECT_TRUE(spa(ToBytes("<1D:SPCJ 4D29:18\r\n")));
  EXPECT_FALSE(spa(ToBytes("<1D:SPCJ 4D28:18\r\n")));
  const auto dcon = RealLine("Dcon9600").good_checksum;
  EXPECT_TRUE(dcon(ToBytes(">+100.23+34.050E2\r")));
  EXPECT_FALSE(dcon(ToBytes(">+100.23+34.051E2\r")));
  const auto meter = RealLine("Set4tm9600").good_checksum;
  EXPECT_TRUE(meter(*ParseHex("C8 00 80 66 43 AE 69")));
  EXPECT_FALSE(meter(*ParseHex("C8 00 80 67 43 AE 69")));
}

TEST(DamageOracle, DetectsAWrongValue) {
  Rig rig(RealLine("Spa9600"));
  rig.LearnTruth();
  rig.Watch([](std::uint32_t device) { return device == 1; });
  rig->RunFor(5s);
  EXPECT_EQ(rig.wrong(), 0U);
  rig->twin(1).values.Set(0, 7.0);
  rig->RunFor(2s);
  EXPECT_EQ(rig.wrong(), 2U) << "one for each poll";
}

constexpr Duration kWanted = 1500ms;
constexpr int kReturns = 30;

class Returning {
 public:
  Returning(const Setup& setup, const std::string& port)
      : rig_(setup, [&](config::Line& line) {
          line.port = port;
          for (config::Device& device : line.devices) device.poll = 10ms;
        }) {
    rig_->Open();
    rig_->RunFor(20s);
  }

  Duration LoseAndReturn(Duration phase) {
    rig_->RunFor(phase);
    rig_->Close();
    rig_->RunFor(300ms);
    const std::size_t before = Answered();
    const Instant opened = rig_->now().instant;
    rig_->Open();
    EXPECT_TRUE(rig_->RunUntil([&] { return Answered() > before; }, 1min));
    return rig_->now().instant - opened;
  }

 private:
  std::size_t Answered() {
    std::size_t sum = 0;
    for (std::uint32_t i = 0; i < rig_.devices(); ++i) sum += rig_->twin(i).answered;
    return sum;
  }

  Rig rig_;
};

Duration Longest(Returning& line, Duration settle = {}) {
  std::mt19937 random(1);
  Duration longest{};
  for (int i = 0; i < kReturns; ++i) {
    longest = std::max(longest,
                       line.LoseAndReturn(settle + std::chrono::microseconds(random() % 700'000)));
  }
  return longest;
}

class APortThatReturns : public ::testing::TestWithParam<Setup> {};

TEST_P(APortThatReturns, IsServedAtOnce) {
  Returning line(GetParam(), "/dev/ttyTEST0");
  EXPECT_LE(Longest(line), kWanted);
}

/// While no client is connected, a serial server stores a late reply. Only the device that has not
/// replied yet waits for it.
TEST_P(APortThatReturns, IsServedAtOnceBehindASerialServer) {
  Returning line(GetParam(), "tcp://server:4001");
  EXPECT_LE(Longest(line, 15s), kWanted);
}

INSTANTIATE_TEST_SUITE_P(RealLines, APortThatReturns, ::testing::ValuesIn(RealLines()), SetupName);
INSTANTIATE_TEST_SUITE_P(Network, APortThatReturns, ::testing::Values(TcpLine()), SetupName);

TEST(APortThatReturns, IsServedSoonWithASingleDevice) {
  protocols::Setup alone = RealLine("Spa9600");
  alone.addresses.resize(1);
  Returning line(alone, "/dev/ttyTEST0");
  EXPECT_LE(Longest(line), kWanted);
}

}  // namespace
}  // namespace baudgate::protocols
