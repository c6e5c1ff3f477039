// Tests of dead devices under virtual time: how much line time they cost, and how soon a device
// that returns is noticed.
// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "gateway/bus/devices/device_health.h"
#include "tests/gateway/bus/poller/poller_fixture.h"
#include "tests/gateway/bus/poller/truth.h"
#include "tests/support/long_run.h"

namespace baudgate::bus {
namespace {

struct Crowd {
  int living = 5;
  int dead = 0;
  Duration poll = 1s;
  std::size_t points = 4;
};

/// Makes living devices, then dead devices, at 9600 7E1: a character takes about a millisecond.
std::unique_ptr<VirtualLine> MakeCrowd(const Crowd& crowd) {
  std::vector<std::string> reads;
  for (std::size_t i = 0; i < crowd.points; ++i) reads.push_back(std::to_string(i));
  std::vector<config::Device> devices;
  for (int i = 0; i < crowd.living + crowd.dead; ++i) {
    const char letter = static_cast<char>(i < 26 ? 'A' + i : 'a' + i - 26);
    devices.push_back(ToyDevice("d" + std::to_string(i), std::string(1, letter), reads));
    devices.back().poll = crowd.poll;
  }
  config::Line line = ToyLine(std::move(devices));
  line.serial.data_bits = 7;
  line.serial.parity = config::Parity::even;
  auto made = std::make_unique<VirtualLine>(
      std::move(line), std::vector<const protocols::Protocol*>{&ToyProtocol()});
  for (int i = crowd.living; i < crowd.living + crowd.dead; ++i) {
    made->twin(static_cast<std::size_t>(i)).manner.dead = true;
  }
  return made;
}

std::uint64_t RateBesideDead(int dead, Duration poll) {
  const auto line = MakeCrowd({.dead = dead, .poll = poll});
  line->Open();
  line->RunFor(5min);
  const std::uint64_t before = line->store().ReadLine(0).Count(Outcome::ok);
  line->RunFor(static_cast<std::int64_t>(LongRun(60)) * 1min);
  return line->store().ReadLine(0).Count(Outcome::ok) - before;
}

class BesideDead : public ::testing::TestWithParam<Duration> {};

TEST_P(BesideDead, DeadDevicesSlowALivingDeviceByAtMostThreePercent) {
  const auto alone = static_cast<double>(RateBesideDead(0, GetParam()));
  for (const int dead : {1, 10, 30}) {
    EXPECT_GE(static_cast<double>(RateBesideDead(dead, GetParam())), 0.97 * alone)
        << dead << " dead devices";
  }
}

INSTANTIATE_TEST_SUITE_P(Polls, BesideDead, ::testing::Values(10ms, 600ms, 1s, 5s),
                         [](const auto& info) { return FormatDuration(info.param); });

class DeviceReturn : public ::testing::TestWithParam<Crowd> {};

TEST_P(DeviceReturn, IsNoticedWithinTheReportedBound) {
  const auto line = MakeCrowd(GetParam());
  line->Open();
  line->RunFor(10min);
  const auto first = static_cast<std::uint32_t>(GetParam().living);
  for (int round = 0; round < 3; ++round) {
    const Duration bound = line->store().ReadLine(0).notice_bound.value();
    const std::uint32_t seen = line->StatusOf(first).exchanges;
    ASSERT_TRUE(line->RunUntil([&] { return line->StatusOf(first).exchanges > seen; }, 2 * bound));
    line->twin(first).manner.dead = false;
    EXPECT_TRUE(
        line->RunUntil([&] { return line->StatusOf(first).state == DeviceState::online; }, bound))
        << "not within " << FormatDuration(bound);
    line->twin(first).manner.dead = true;
    line->RunFor(5min);
    ASSERT_EQ(line->StatusOf(first).state, DeviceState::offline);
  }
}

INSTANTIATE_TEST_SUITE_P(Crowds, DeviceReturn,
                         ::testing::Values(Crowd{.dead = 1}, Crowd{.dead = 10},
                                           Crowd{.dead = 10, .poll = 600ms},
                                           Crowd{.dead = 3, .poll = 10ms},
                                           Crowd{.living = 0, .dead = 10},
                                           Crowd{.living = 20, .dead = 10, .poll = 1s}),
                         [](const auto& info) {
                           return std::to_string(info.param.dead) + "Beside" +
                                  std::to_string(info.param.living) + "At" +
                                  FormatDuration(info.param.poll);
                         });

TEST(PollerDead, TenDeadDevicesOnAnUnsaturatedLineHaveABoundOfAMinute) {
  const auto line = MakeCrowd({.dead = 10});
  line->Open();
  line->RunFor(10min);
  const LineStatus status = line->store().ReadLine(0);
  EXPECT_LT(status.use, 0.9) << "the line has time to spare, or this shows nothing";
  EXPECT_LE(status.notice_bound, 60s);
  EXPECT_GT(status.notice_bound, 5s);
}

TEST(PollerDead, ADeadDeviceAloneOnItsLineIsProbedAtFullRate) {
  const auto line = MakeCrowd({.living = 0, .dead = 1});
  line->Open();
  line->RunFor(10min);
  const std::uint64_t before = line->store().ReadLine(0).probes;
  line->RunFor(60s);
  EXPECT_GE(line->store().ReadLine(0).probes - before, 60U);
}

TEST(PollerDead, LivingDevicesArePolledWhileManyFallSilentTogether) {
  const auto line = MakeCrowd({.living = 1, .dead = 10, .points = 1});
  for (std::size_t i = 1; i <= 10; ++i) line->twin(i).manner.dead = false;
  line->Open();
  line->RunFor(1min);
  for (std::size_t i = 1; i <= 10; ++i) line->twin(i).manner.dead = true;
  Duration oldest{};
  line->always = [&] { oldest = std::max(oldest, line->AgeOf(0, 0).value_or(0ms)); };
  const std::uint32_t before = line->StatusOf(0).Count(Outcome::ok);
  const auto all_gone = [&] {
    for (std::uint32_t i = 1; i <= 10; ++i) {
      if (line->StatusOf(i).state != DeviceState::offline) return false;
    }
    return true;
  };
  const Duration from = line->elapsed();
  ASSERT_TRUE(line->RunUntil(all_gone, 2min));
  const auto seconds = (line->elapsed() - from) / 1s;
  EXPECT_GE(line->StatusOf(0).Count(Outcome::ok) - before, seconds / 2);
  EXPECT_LE(oldest, 4s);
  EXPECT_LE(seconds, 60);
  line->RunFor(1min);
  EXPECT_LE(line->store().ReadLine(0).notice_bound, 1min);
}

/// Device D ignores a request that comes less than 150 ms after another telegram.
TEST(PollerDead, AReturningDeviceThatNeedsAPauseIsFoundOnABusyLine) {
  const auto line = MakeCrowd({.living = 3, .dead = 1, .poll = 30ms, .points = 1});
  Instant latest{};
  line->server = [&](View request, Bytes reply, Instant end) {
    const Duration sent = static_cast<std::int64_t>(request.size()) * 1100us;
    const bool soon = end - sent - latest < 150ms;
    if (request[1] == 'D' && soon) reply.clear();
    const Duration takes = 5ms + static_cast<std::int64_t>(reply.size()) * 1100us;
    latest = reply.empty() ? end : end + takes;
    std::vector<tools::TimedPiece> pieces;
    if (!reply.empty()) pieces.push_back({5ms, std::move(reply)});
    return pieces;
  };
  line->Open();
  line->RunFor(1min);
  line->twin(3).manner.dead = false;
  EXPECT_TRUE(line->RunUntil([&] { return line->StatusOf(3).Count(Outcome::ok) > 0; }, 10min));
}

TEST(PollerDead, ALineWithoutDeadDevicesReportsNoBound) {
  const auto line = MakeCrowd({});
  line->Open();
  line->RunFor(1min);
  EXPECT_EQ(line->store().ReadLine(0).notice_bound, std::nullopt);
}

TEST(Poller, DeadDevicesSlowALivingDeviceByAtMostSixPercent) {
  const auto answered_in_a_minute = [](bool dead_neighbours) {
    std::vector<config::Device> devices = {Polled(ToyDevice("a", "A", {"1", "2"}), 50ms)};
    for (const char* name : {"b", "c", "d"}) {
      devices.push_back(Polled(ToyDevice(name, std::string(1, char(name[0] - 32)), {"1"}), 50ms));
    }
    VirtualLine line(ToyLine(devices), {&ToyProtocol()});
    if (!dead_neighbours) {
      VirtualLine alone(ToyLine({devices[0]}), {&ToyProtocol()});
      alone.Open();
      alone.RunFor(60s);
      return alone.twin(0).answered;
    }
    for (std::size_t i = 1; i < 4; ++i) line.twin(i).manner.dead = true;
    line.Open();
    line.RunFor(60s);
    return line.twin(0).answered;
  };
  const std::size_t alone = answered_in_a_minute(false);
  const std::size_t among_dead = answered_in_a_minute(true);
  EXPECT_GE(among_dead * 100, alone * 94) << among_dead << " of " << alone;
}

std::unique_ptr<VirtualLine> DeadBesideBusy() {
  auto line =
      std::make_unique<VirtualLine>(ToyLine({Polled(ToyDevice("a", "A", {"1", "2", "3"}), 10ms),
                                             Polled(ToyDevice("b", "B", {"1"}), 10ms)}),
                                    std::vector<const protocols::Protocol*>{&ToyProtocol()});
  line->twin(1).manner.dead = true;
  return line;
}

TEST(PollerDead, ADeviceLostAtTheStartReturnsWithinSeconds) {
  const auto line_of_two = DeadBesideBusy();
  VirtualLine& line = *line_of_two;
  line.Open();
  ASSERT_TRUE(line.RunUntil([&] { return line.StatusOf(1).exchanges == 2; }, 1min));
  line.twin(1).manner.dead = false;
  const Duration from = line.elapsed();
  EXPECT_TRUE(line.RunUntil([&] { return line.QualityOf(1, 0) == Quality::good; }, 10s));
  EXPECT_LT(line.elapsed() - from, 5s);
}

TEST(Poller, AReturnIsNoticedOnALineThatIsNeverIdle) {
  const auto line_of_two = DeadBesideBusy();
  VirtualLine& line = *line_of_two;
  line.Open();
  line.RunFor(60s);
  ASSERT_EQ(line.StatusOf(1).state, DeviceState::offline);
  line.twin(1).manner.dead = false;
  EXPECT_TRUE(line.RunUntil([&] { return line.QualityOf(1, 0) == Quality::good; }, 30s));
}

TEST(Poller, ADeviceGoesOfflineAfterEnoughFailuresAndTime) {
  VirtualLine line(ToyLine({Polled(ToyDevice("a", "A", {"1"}), 100ms)}), {&ToyProtocol()});
  line.Open();
  line.RunFor(1s);
  const Instant died = line.now().instant;
  line.twin(0).manner.dead = true;
  ASSERT_TRUE(line.RunUntil([&] { return line.StatusOf(0).state == DeviceState::offline; }, 30s));
  EXPECT_GE(line.now().instant - died, DeviceHealth::kOfflineTime);
  EXPECT_EQ(line.states[1].to, DeviceState::degraded) << "one change after the other";
  EXPECT_EQ(line.states.back().to, DeviceState::offline);
}

TEST(Poller, NeverSeenDeviceIsProbedOnly) {
  VirtualLine line(ToyLine({ToyDevice("a", "A", {"1", "2", "3"})}), {&ToyProtocol()});
  line.twin(0).manner.dead = true;
  line.Open();
  line.RunFor(60s);
  EXPECT_EQ(line.CountSent("?A"), 0U);
  EXPECT_GT(line.CountSent("PA0"), 20U);
  EXPECT_EQ(line.StatusOf(0).retries, 0U);
}

TEST(Poller, AReturningDeviceIsPolledAtOnce) {
  config::Device device = ToyDevice("a", "A", {"1"});
  device.points[0].group = config::Group::slow;
  device.slow = 1h;
  device.points.push_back(ToyDevice("", "", {"2"}).points[0]);
  VirtualLine line(ToyLine({device}), {&ToyProtocol()});
  line.twin(0).manner.dead = true;
  line.Open();
  line.RunFor(1min);
  ASSERT_EQ(line.StatusOf(0).state, DeviceState::offline);
  line.twin(0).manner.dead = false;
  ASSERT_TRUE(line.RunUntil([&] { return line.twin(0).answered == 1; }, 2s))
      << "probed on an idle line";
  line.RunFor(1200ms);
  EXPECT_EQ(line.QualityOf(0, 0), Quality::good) << "the slow group as well";
  EXPECT_EQ(line.QualityOf(0, 1), Quality::good);
  ASSERT_FALSE(line.states.empty());
  EXPECT_EQ(line.states.back().to, DeviceState::online);
}

TEST(PollerFaults, DoubledRepliesGiveNoWrongValues) {
  VirtualLine line(ToyLine({ToyDevice("a", "A", {"U1", "U2"})}), {&ToyProtocol()});
  SetTruth(line, 1, 2);
  line.always = [&] { ExpectOnlyTruth(line, 1, 2); };
  line.twin(0).manner.copies = 2;
  line.Open();
  line.RunFor(10s);
  EXPECT_EQ(line.QualityOf(0, 1), Quality::good);
}

/// Device a sends a reply twice. The copy can be mistaken for a reply of device b, because the
/// silence before it was shorter than b's reply time of 2 s. So b must be read again.
TEST(PollerFaults, ASecondReplyOfAFastDeviceMakesASlowDeviceBeReadAgain) {
  config::Line bus = ToyLine({ToyDevice("a", "A", {"1"}), ToyDevice("b", "B", {"1"})});
  bus.devices[0].poll = 300ms;
  bus.devices[1].poll = 20s;
  bus.devices[1].timing.reply = 2s;
  bus.devices[1].timing.ceiling = 4s;
  VirtualLine line(std::move(bus), {&ToyProtocol()});
  bool doubled = false;
  const auto pieces = [&](View, Bytes reply, Instant) {
    std::vector<tools::TimedPiece> said = {{20ms, reply}};
    if (std::exchange(doubled, false)) said.push_back({21ms, ToyReply("A1=77")});
    return said;
  };
  line.Open();
  line.twin(0).manner.deliver = pieces;
  ASSERT_TRUE(line.RunUntil([&] { return line.QualityOf(1, 0) == Quality::good; }, 5s));
  line.RunFor(500ms);
  const std::uint64_t before = line.StatusOf(1).exchanges;
  doubled = true;
  ASSERT_TRUE(line.RunUntil([&] { return line.StatusOf(0).doubled > 0; }, 1s));
  line.RunFor(2s);
  EXPECT_GT(line.StatusOf(1).exchanges, before) << "read again, long before its period is over";
}

TEST(PollerFaults, AnOddFormOfOneReplyLeavesTheOtherValuesGood) {
  VirtualLine line(ToyLine({ToyDevice("a", "A", {"U1", "2", "U3"})}), {&ToyProtocol()});
  line.twin(0).manner.instead = [](View request) -> std::optional<Bytes> {
    if (AsText(request) != "?A2\r") return std::nullopt;
    return ToyReply("A9=1");
  };
  line.Open();
  line.RunFor(10s);
  int uncertain = 0;
  line.always = [&] {
    const bool good =
        line.QualityOf(0, 0) == Quality::good && line.QualityOf(0, 2) == Quality::good;
    if (!good) ++uncertain;
  };
  line.RunFor(5min);
  EXPECT_EQ(uncertain, 0);
  EXPECT_NE(line.QualityOf(0, 1), Quality::good);
}

TEST(PollerFaults, ADeviceWhoseOnlyReplyHasAnOddFormIsNotOffline) {
  VirtualLine line(ToyLine({ToyDevice("a", "A", {"1"})}), {&ToyProtocol()});
  line.twin(0).manner.instead = [](View request) -> std::optional<Bytes> {
    if (AsText(request) != "?A1\r") return std::nullopt;
    return ToyReply("A9=1");
  };
  line.Open();
  line.RunFor(5min);
  EXPECT_TRUE(Answers(line.StatusOf(0).state)) << line.StatusOf(0).last_reason;
  EXPECT_NE(line.QualityOf(0, 0), Quality::good);
}

/// Each copy is mistaken for the reply to the next request. When the true reply follows, the
/// gateway detects the mistake, and the last reading must become uncertain and be read again.
class SecondReply : public ::testing::TestWithParam<std::size_t> {};

TEST_P(SecondReply, ACopyMistakenForTheNextReplyIsDetected) {
  const std::size_t last = GetParam() - 1;
  std::vector<std::string> reads;
  for (std::size_t i = 1; i <= GetParam(); ++i) reads.push_back("U" + std::to_string(i));
  const std::string doubled_one = "UA" + std::to_string(last) + "\r";
  VirtualLine line(ToyLine({ToyDevice("a", "A", reads)}), {&ToyProtocol()});
  SetTruth(line, 1, GetParam());
  bool doubled = false;
  const auto pieces = [&](View request, Bytes reply, Instant) {
    const Duration whole = static_cast<std::int64_t>(reply.size()) * 1042us;
    std::vector<tools::TimedPiece> said = {{5ms + whole, reply}};
    if (doubled && AsText(request) == doubled_one) said.push_back({25ms + whole, reply});
    return said;
  };
  line.Open();
  line.RunFor(2500ms);
  line.twin(0).manner.deliver = pieces;
  doubled = true;
  bool wrong = false;
  const auto is_wrong = [&] {
    return line.ValueOf(0, static_cast<std::uint32_t>(last)) != Value(TruthOf(0, last));
  };
  line.always = [&] { wrong = wrong || is_wrong(); };
  line.RunFor(1s);
  ASSERT_TRUE(wrong) << "else this test shows nothing";
  doubled = false;
  line.always = {};
  ASSERT_FALSE(line.warnings.empty());
  EXPECT_NE(line.warnings.back().find("two different replies"), std::string::npos);
  EXPECT_GE(line.StatusOf(0).doubled, 1U);
  EXPECT_TRUE(line.RunUntil([&] { return !is_wrong(); }, 600ms))
      << "without waiting for its period";
  EXPECT_EQ(line.QualityOf(0, static_cast<std::uint32_t>(last)), Quality::good);
}

INSTANTIATE_TEST_SUITE_P(Points, SecondReply, ::testing::Values(2, 12));

}  // namespace
}  // namespace baudgate::bus
