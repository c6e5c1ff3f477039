// Tests of transparent routes with faults, under virtual time: how long a start or stop waits.
// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>

#include "gateway/bus/poller/poller.h"
#include "tests/gateway/bus/poller/routed_line.h"

namespace baudgate::bus {
namespace {

using config::Priority;
using ::testing::_;
using ::testing::ElementsAre;

constexpr const char* kStartOnWire = "14 06 00 00 00 02";
constexpr const char* kStopOnWire = "14 06 00 00 00 00";

std::vector<std::string> OnWireAfter(const RoutedLine& line, std::size_t count) {
  std::vector<std::string> wire = line.OnWire();
  wire.erase(wire.begin(), wire.begin() + static_cast<std::ptrdiff_t>(count));
  return wire;
}

config::Line WrittenDrive() {
  config::Line settings = DriveLine({Polled("20", 2, 10s)});
  settings.devices[0].points[0].write = "holding 0";
  return settings;
}

/// Makes the line busy with a long read of slave 21. Returns the number of requests before it.
std::size_t StartBlock(RoutedLine& line) {
  line.RunFor(5s);
  const std::size_t before = line.sent.size();
  line.Ask("block", kBlock, 21);
  line.RunFor(10ms);
  return before;
}

TEST(PollerRoutedOrder, ACommandBeforeARoutedWriteToTheSameSlaveKeepsItsPlace) {
  RoutedLine line(WrittenDrive(), {"21"});
  const std::size_t before = StartBlock(line);
  line.Write(0, 0, Value(2.0));
  line.Ask("stop", kStop, 20, 2);
  line.RunFor(2s);
  EXPECT_THAT(OnWireAfter(line, before),
              ElementsAre("15 03 00 00 00 78", kStartOnWire, kStopOnWire, _));
}

TEST(PollerRoutedOrder, ARoutedWriteBeforeACommandToTheSameSlaveKeepsItsPlace) {
  RoutedLine line(WrittenDrive(), {"21"});
  const std::size_t before = StartBlock(line);
  std::string preset = "10 00 00 00 09 12";
  for (int i = 0; i < 18; ++i) preset += " 00";
  line.Ask("preset", preset, 20, 2);
  line.Write(0, 0, Value(2.0));
  line.RunFor(2s);
  EXPECT_THAT(OnWireAfter(line, before),
              ElementsAre("15 03 00 00 00 78", "14 " + preset, kStartOnWire, _));
}

TEST(PollerRoutedOrder, AStartDoesNotWaitForTheRetriesOfADamagedBlock) {
  RoutedLine line;
  line.twin(0).manner.distort = [](Bytes reply) {
    return reply.size() > 100 ? Damaged(std::move(reply)) : reply;
  };
  line.Ask("block", kBlock);
  line.RunFor(10ms);
  line.Ask("start", kStartDrive, 20, 2);
  line.RunFor(5s);
  ASSERT_GT(line.sent.size(), 2U) << "the block is repeated, but later";
  EXPECT_EQ(line.OnWire()[1], kStartOnWire);
}

TEST(PollerRoutedOrder, AStartDoesNotWaitForTheRetriesOfAPoll) {
  RoutedLine line(DriveLine({Polled("21", 2)}), {"20"});
  line.Ask("warm", kRead);
  line.RunFor(5500ms);
  line.twin(0).manner.dead = true;
  const std::size_t before = line.sent.size();
  ASSERT_TRUE(line.RunUntil([&] { return line.sent.size() > before; }, 5s));
  line.RunFor(20ms);
  line.Ask("start", kStartDrive, 20, 2);
  line.RunFor(5s);
  ASSERT_GT(line.sent.size(), before + 1);
  EXPECT_EQ(line.OnWire()[before + 1], kStartOnWire);
}

TEST(PollerRoutedOrder, AStartForAnAbsentSlaveTakesNoRetriesFromTheOthers) {
  RoutedLine line(DriveLine({Polled("21", 2, 200ms)}), {});
  std::uint32_t replies = 0;
  std::uint32_t lost = 0;
  line.twin(0).manner.distort = [&](Bytes reply) {
    if (++replies % 4 != 0) return reply;
    ++lost;
    return Bytes();
  };
  BusyClients clients(line);
  clients.Add(kStartDrive, 99);
  line.RunFor(10s);
  const std::uint32_t lost_before = lost;
  const std::uint32_t repeated_before = line.StatusOf(0).retries;
  line.RunFor(60s);
  EXPECT_GT(lost - lost_before, 20U);
  EXPECT_GE(line.StatusOf(0).retries - repeated_before, (lost - lost_before) * 9 / 10);
  EXPECT_GT(clients.failed(0), 10) << "it does wait all the time";
}

TEST(PollerRoutedOrder, AStartDoesNotMakeADestructiveReadHappenTwice) {
  config::Device counter = ToyDevice("counter", "A", {"L7"});
  counter.protocol = ToyProtocol().name;
  RoutedLine line(DriveLine({counter}), {"20"});
  line.RunFor(5500ms);
  line.twin(0).manner.dead = true;
  const std::size_t before = line.CountSent("LA7");
  ASSERT_TRUE(line.RunUntil([&] { return line.CountSent("LA7") > before; }, 5s));
  line.Ask("start", kStartDrive);
  ASSERT_TRUE(line.RunUntil([&] { return !line.replies.empty(); }, 5s));
  line.twin(0).manner.dead = false;
  line.RunFor(300ms);
  EXPECT_EQ(line.CountSent("LA7"), before + 1);
  EXPECT_GT(line.CountSent("BA7"), 0U);
}

TEST(PollerRoutedOrder, AStartDoesNotWaitForAPollThatIsHeldBack) {
  config::Line settings = DriveLine({Polled("21", 2, 100ms)});
  settings.devices[0].retries = 0;
  RoutedLine line(std::move(settings), {"20"});
  line.Ask("warm", kRead);
  line.RunFor(5s);
  line.twin(0).manner.dead = true;
  line.Ask("lost", kOther, 21, 7);
  ASSERT_TRUE(line.RunUntil([&] { return line.replies.size() == 2; }, 5s));
  line.RunFor(105ms);
  const std::size_t before = line.sent.size();
  const Instant asked = line.now().instant;
  line.Ask("start", kStartDrive, 20, 2);
  line.RunFor(5s);
  ASSERT_GT(line.sent.size(), before);
  EXPECT_EQ(line.OnWire()[before], kStartOnWire);
  EXPECT_LT(line.sent[before].at - asked, 20ms);
}

TEST(PollerRoutedOrder, AStartDoesNotWaitBecauseAnotherSlaveOnceLostAReply) {
  RoutedLine line;
  line.Ask("warm", kRead);
  line.Ask("warm too", kRead, 21);
  line.RunFor(2s);
  line.twin(0).manner.dead = true;
  line.Ask("lost", kRead);
  line.RunFor(1s);
  line.twin(0).manner.dead = false;
  line.RunFor(5s);
  line.Ask("good", kRead);
  ASSERT_TRUE(line.RunUntil([&] { return line.replies.size() == 4; }, 5s));
  const std::size_t before = line.sent.size();
  const Instant asked = line.now().instant;
  line.Ask("start", kStartDrive, 21, 2);
  line.RunFor(3s);
  ASSERT_GT(line.sent.size(), before);
  EXPECT_LT(line.sent[before].at - asked, 50ms);
}

TEST(PollerRoutedOrder, AReadDoesNotWaitForTheLateReplyOfAnotherSlave) {
  RoutedLine line;
  line.Ask("warm", kRead);
  line.Ask("warm too", kRead, 21);
  line.RunFor(1s);
  line.twin(0).manner.dead = true;
  line.Ask("lost", kRead);
  line.RunFor(10ms);
  line.Ask("again", kOther, 20, 2);
  line.Ask("read", kRead, 21, 3);
  line.RunFor(2s);
  ASSERT_GE(line.sent.size(), 5U);
  EXPECT_EQ(line.OnWire()[3], "15 03 00 00 00 01");
}

TEST(PollerRoutedOrder, AWriteIsNotSentBeyondItsDeadlineOnABabblingLine) {
  RoutedLine line;
  line.Ask("warm", kRead);
  line.RunFor(1s);
  for (int i = 0; i < 700; ++i) line.Inject({0x55}, i * 1ms);
  line.RunFor(10ms);
  const Instant deadline = line.now().instant + 100ms;
  line.Ask("start", kStartDrive, 20, 2, Priority::normal, 100ms);
  line.RunFor(3s);
  EXPECT_EQ(line.sent.size(), 1U);
  EXPECT_EQ(line.Of("start").outcome, Outcome::no_reply);
  EXPECT_FALSE(line.Of("start").sent);
  EXPECT_LE(line.replies.back().at, deadline);
}

TEST(PollerRoutedOrder, OnlyAReadThatWaitsForAQuietLineLetsAStartPass) {
  std::string preset = "10 00 00 00 09 12";
  for (int i = 0; i < 18; ++i) preset += " 00";
  for (const bool read : {true, false}) {
    RoutedLine line;
    line.Ask("warm", kRead, 20);
    line.Ask("warm too", kRead, 21);
    line.RunFor(1s);
    const std::size_t before = line.sent.size();
    for (int i = 0; i < 100; ++i) line.Inject({0x55}, i * 1ms);
    line.RunFor(10ms);
    line.Ask("first", read ? kRead : preset, 21);
    line.RunFor(10ms);
    line.Ask("start", kStartDrive, 20, 2);
    line.RunFor(1s);
    EXPECT_EQ(line.OnWire()[before], read ? kStartOnWire : "15 " + preset);
  }
}

TEST(PollerRoutedOrder, NoRetryIsSentForAClientThatHasLeft) {
  RoutedLine line;
  line.twin(0).manner.distort = Damaged;
  line.Ask("read", kRead, 20, 5);
  line.RunFor(100ms);
  line.poller().Abandon(5, line.now());
  line.RunFor(3s);
  EXPECT_EQ(line.sent.size(), 1U);
  EXPECT_TRUE(line.Of("read").sent);
  EXPECT_THAT(line.Names(), ElementsAre("read"));
}

TEST(PollerRoutedOrder, NoRetryIsSentBeyondTheDeadline) {
  RoutedLine line;
  line.twin(0).manner.distort = Damaged;
  line.Ask("read", kRead, 20, 5, Priority::normal, 50ms);
  line.RunFor(3s);
  EXPECT_EQ(line.sent.size(), 1U);
  EXPECT_EQ(line.Of("read").outcome, Outcome::no_reply);
  EXPECT_TRUE(line.Of("read").sent) << "once";
}

TEST(PollerRoutedOrder, AClientThatLeavesASharedExchangeDoesNotEndIt) {
  RoutedLine line;
  line.Ask("under way", kRead, 20, 1);
  line.Ask("a", kRead, 20, 2);
  line.Ask("b", kRead, 20, 3);
  ASSERT_TRUE(line.RunUntil([&] { return line.sent.size() == 2; }, 1s));
  line.poller().Abandon(2, line.now());
  EXPECT_THAT(line.Names(), ElementsAre("under way", "a"));
  line.RunFor(1s);
  EXPECT_THAT(line.Names(), ElementsAre("under way", "a", "b"));
  EXPECT_EQ(line.Of("b").outcome, Outcome::ok);
}

// A disabled device is not polled, so only a routed request can notice that it has returned.
TEST(PollerRoutedOrder, ADisabledDeviceThatWasAbsentIsReachedAgain) {
  config::Line settings = DriveLine({Polled("20", 2)});
  settings.devices[0].enabled = false;
  RoutedLine line(std::move(settings), {});
  line.twin(0).manner.dead = true;
  line.Ask("lost", kRead);
  line.RunFor(5s);
  EXPECT_EQ(line.Of("lost").outcome, Outcome::no_reply);
  line.twin(0).manner.dead = false;
  BusyClients clients(line);
  clients.Add(kRead, 20);
  line.RunFor(10s);
  EXPECT_GT(clients.answered(0), 100);
}

TEST(PollerRoutedOrder, ADeviceTakenOutOfUseWhileOfflineIsReachedAgain) {
  RoutedLine line(DriveLine({Polled("20", 2)}), {});
  line.RunFor(5s);
  line.twin(0).manner.dead = true;
  line.RunFor(20s);
  ASSERT_EQ(line.StatusOf(0).state, DeviceState::offline);
  line.poller().SetInUse(0, false, line.now());
  line.twin(0).manner.dead = false;
  BusyClients clients(line);
  clients.Add(kRead, 20);
  line.RunFor(10s);
  EXPECT_GT(clients.answered(0), 100);
}

TEST(PollerRoutedOrder, AReadIsSentBetweenTheWritesOfABusyClient) {
  RoutedLine line;
  line.Ask("read", kRead, 21, 2, Priority::normal, 1min);
  for (int writes = 0; writes < 40; ++writes) {
    const std::string name = "write " + std::to_string(writes);
    line.Ask(name, kStartDrive);
    ASSERT_TRUE(line.RunUntil(
        [&] { return !line.replies.empty() && line.replies.back().name == name; }, 1s));
    line.RunFor(300us);
  }
  const auto wire = line.OnWire();
  const auto read = std::ranges::find(wire, "15 03 00 00 00 01") - wire.begin();
  EXPECT_LE(read, 17);
  EXPECT_GE(read, 10) << "writes go first";
}

// A client asks the slaves in turn and waits only 900 ms for each reply.
class AskedInTurn : public ::testing::TestWithParam<const char*> {};

TEST_P(AskedInTurn, AReturningSlaveIsFoundByAClientThatAsksSlavesInTurn) {
  RoutedLine line;
  const std::string pdu = GetParam();
  int number = 0;
  const auto ask = [&](std::uint8_t slave, const std::string& what) {
    const std::string name = std::to_string(number++);
    line.Ask(name, what, slave, 1, Priority::normal, 900ms);
    EXPECT_TRUE(line.RunUntil(
        [&] { return !line.replies.empty() && line.replies.back().name == name; }, 2s));
    line.RunFor(5ms);
    return line.Of(name).outcome;
  };
  const auto round_for = [&](Duration time) {
    const Instant end = line.now().instant + time;
    bool found = false;
    while (!found && line.now().instant < end) {
      ask(20, kRead);
      found = ask(21, pdu) == Outcome::ok;
    }
    return found;
  };
  EXPECT_TRUE(round_for(1s));
  line.twin(1).manner.dead = true;
  EXPECT_FALSE(round_for(10s));
  line.twin(1).manner.dead = false;
  EXPECT_TRUE(round_for(30s));
}

INSTANTIATE_TEST_SUITE_P(Requests, AskedInTurn, ::testing::Values(kRead, kStartDrive),
                         [](const auto& info) { return info.index == 0 ? "Read" : "Start"; });

TEST(PollerRoutedOrder, ARequestThatASlaveIgnoresDoesNotMarkTheSlaveAbsent) {
  RoutedLine line;
  for (int i = 0; i < 5; ++i) {
    line.Ask("malformed " + std::to_string(i), "03 00 00 00 01 00");
    line.RunFor(1s);
  }
  line.Ask("read", kRead);
  line.RunFor(1s);
  EXPECT_EQ(line.Of("read").outcome, Outcome::ok);
}

TEST(PollerRoutedOrder, AnIdleLineWakesForTheProbe) {
  RoutedLine line;
  line.twin(1).manner.dead = true;
  line.Ask("lost", kRead, 21);
  line.RunFor(5s);
  line.Ask("living", kRead, 20);
  line.RunFor(500ms);
  line.twin(1).manner.dead = false;
  line.Ask("probe", kRead, 21, 3, Priority::normal, 10s);
  line.RunFor(20s);
  EXPECT_EQ(line.Of("probe").outcome, Outcome::ok);
}

// Probes get 2 % of a busy line's time. A probe that waits 500 ms for a reply can be sent every 25
// s.
TEST(PollerRoutedOrder, ASlaveReturningBesideABusySlaveIsServedWithinHalfAMinute) {
  RoutedLine line;
  BusyClients clients(line);
  clients.Add(kRead, 20);
  clients.Add(kRead, 21);
  clients.Add(kOther, 21);
  line.RunFor(5s);
  line.twin(1).manner.dead = true;
  line.RunFor(40s);
  line.twin(1).manner.dead = false;
  const int before = clients.answered(1) + clients.answered(2);
  const auto served = [&] { return clients.answered(1) + clients.answered(2) > before; };
  EXPECT_TRUE(line.RunUntil(served, 30s));
}

TEST(PollerRoutedOrder, AProbeDelayedByAWriteIsCountedWhenItIsSent) {
  config::Line config = DriveLine();
  config.timing.quiet = 20ms;
  RoutedLine line(std::move(config));
  line.Ask("warm", kRead);
  line.RunFor(1s);
  line.twin(1).manner.dead = true;
  for (int i = 0; i < 5; ++i) {
    line.Ask("vain", kRead, 21, 2);
    line.RunFor(3s);
  }
  const auto sent = [&line] {
    const auto wire = line.OnWire();
    return std::ranges::count_if(wire, [](const auto& one) { return one.starts_with("15"); });
  };
  const auto counted = [&line] {
    return static_cast<std::ptrdiff_t>(line.store().ReadLine(0).probes);
  };
  const auto before = counted() - sent();
  for (int i = 0; i < 50; ++i) {
    line.Ask("read", kRead);
    line.Ask("look", kRead, 21, 2, config::Priority::normal, 3s);
    ASSERT_TRUE(line.RunUntil([&] { return line.Names().back() == "read"; }, 1s));
    line.RunFor(10ms);
    line.Ask("start", kStartDrive);
    line.RunFor(4s);
  }
  EXPECT_EQ(counted() - sent(), before);
}

}  // namespace
}  // namespace baudgate::bus
