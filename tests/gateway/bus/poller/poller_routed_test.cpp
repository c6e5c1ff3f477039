// Tests of transparent routes with Modbus RTU slaves, under virtual time.
// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "gateway/base/text.h"
#include "gateway/bus/poller/poller.h"
#include "tests/gateway/bus/poller/routed_line.h"

namespace baudgate::bus {
namespace {

using config::Priority;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

TEST(PollerRouted, RequestAndReplyPassUnchanged) {
  RoutedLine line;
  line.twin(0).values.Set(0, std::uint64_t{2500});
  line.Ask("read", kRead);
  line.RunFor(1s);
  EXPECT_EQ(line.Of("read").outcome, Outcome::ok);
  EXPECT_EQ(ToHex(line.Of("read").pdu), "03 02 09 C4");
  EXPECT_TRUE(line.Of("read").sent);
  EXPECT_THAT(line.OnWire(), ElementsAre("14 03 00 00 00 01"));
}

TEST(PollerRouted, AnExceptionOfTheSlavePassesUnchanged) {
  RoutedLine line;
  line.Ask("beyond", "03 03 E7 00 01");
  line.RunFor(1s);
  EXPECT_EQ(line.Of("beyond").outcome, Outcome::refused);
  EXPECT_EQ(ToHex(line.Of("beyond").pdu), "83 02");
}

TEST(PollerRouted, ARefusedClientRequestIsNotCountedForTheDevice) {
  RoutedLine line(DriveLine({Polled("20", 1)}), {});
  line.RunFor(100ms);
  line.Ask("beyond", "03 03 E7 00 01");
  line.RunFor(1s);
  EXPECT_EQ(line.Of("beyond").outcome, Outcome::refused);
  EXPECT_EQ(line.StatusOf(0).outcomes[static_cast<std::size_t>(Outcome::refused)], 0U);
  EXPECT_EQ(line.StatusOf(0).exchanges,
            line.StatusOf(0).outcomes[static_cast<std::size_t>(Outcome::ok)]);
}

TEST(PollerRouted, RequestsFailAtOnceWhenThePortIsClosed) {
  RoutedLine line;
  line.Ask("waiting", kBlock);
  line.RunFor(10ms);
  line.Ask("queued", kRead);
  line.Close();
  line.Ask("closed", kRead);
  for (const char* name : {"waiting", "queued", "closed"}) {
    EXPECT_EQ(line.Of(name).outcome, Outcome::line_down) << name;
  }
  line.Open();
  line.RunFor(1s);
  EXPECT_EQ(line.sent.size(), 1U) << "nothing is sent late";
}

TEST(PollerRouted, ARequestWaitingForAQuietLineIsReportedNotSent) {
  for (const bool leaves : {false, true}) {
    RoutedLine line;
    line.Ask("first", kRead);
    ASSERT_TRUE(line.RunUntil([&] { return line.replies.size() == 1; }, 1s));
    line.Ask("start", kStartDrive, 20, 2);
    leaves ? line.poller().Abandon(2, line.now()) : line.Close();
    EXPECT_FALSE(line.Of("start").sent);
    line.RunFor(1s);
    EXPECT_EQ(line.sent.size(), 1U);
  }
}

TEST(PollerRouted, ARequestWaitingForAConnectionIsReportedNotSent) {
  enum class What { leaves, closes, takes_too_long };
  for (const What what : {What::leaves, What::closes, What::takes_too_long}) {
    RoutedLine line;
    line.holds = true;
    line.Ask("start", kStartDrive, 20, 2);
    line.RunFor(10ms);
    if (what == What::leaves) line.poller().Abandon(2, line.now());
    if (what == What::closes) line.Close();
    line.RunFor(1s);
    EXPECT_FALSE(line.Of("start").sent) << static_cast<int>(what);
  }
}

TEST(PollerRouted, ALateReplyIsNotGivenToTheNextRequest) {
  RoutedLine line;
  line.twin(0).values.Set(0, std::uint64_t{1});
  line.twin(0).values.Set(1, std::uint64_t{2});
  line.Ask("first", kRead);
  line.RunFor(1s);
  line.twin(0).manner.think = 620ms;
  line.Ask("late", kRead);
  line.Ask("next", kOther, 20, 2);
  line.RunFor(650ms);
  line.twin(0).manner.think = 5ms;
  line.RunFor(2s);
  EXPECT_EQ(line.Of("late").outcome, Outcome::no_reply);
  EXPECT_EQ(ToHex(line.Of("next").pdu), "03 02 00 02");
}

TEST(PollerRouted, AReplyOfAnotherSlaveIsNotAccepted) {
  RoutedLine line;
  line.twin(0).manner.instead = [](View) { return ParseHex("15 03 02 00 07 C9 85"); };
  line.Ask("read", kRead);
  line.RunFor(2s);
  EXPECT_NE(line.Of("read").outcome, Outcome::ok);
  EXPECT_TRUE(line.Of("read").pdu.empty());
}

TEST(PollerRouted, AStartOvertakesEverythingButTheExchangeUnderWay) {
  RoutedLine line;
  for (int i = 0; i < 9; ++i) line.Ask("block", kBlock + std::string(), 20, 1, Priority::high);
  line.Ask("read", kRead, 21, 2, Priority::high);
  line.RunFor(10ms);
  line.Ask("start", kStartDrive, 20, 3, Priority::low);
  line.RunFor(5s);
  ASSERT_GE(line.OnWire().size(), 2U);
  EXPECT_EQ(line.OnWire()[1], "14 06 00 00 00 02");
}

TEST(PollerRouted, WritesToOneSlaveKeepTheirOrderAndAStartIsNeverReplayedAfterAStop) {
  RoutedLine line;
  line.twin(0).manner.distort = Damaged;
  line.Ask("start", kStartDrive, 20, 1, Priority::low);
  line.Ask("stop", kStop, 20, 2, Priority::high);
  line.RunFor(2s);
  EXPECT_THAT(line.OnWire(), ElementsAre("14 06 00 00 00 02", "14 06 00 00 00 00"));
  EXPECT_EQ(line.Of("start").outcome, Outcome::corrupt);
}

TEST(PollerRouted, ADamagedReadIsRetriedAndAnUnansweredReadIsNot) {
  RoutedLine line;
  int damaged = 0;
  line.twin(0).manner.distort = [&](Bytes reply) {
    return damaged++ == 0 ? Damaged(std::move(reply)) : reply;
  };
  line.Ask("damaged", kRead);
  line.RunFor(2s);
  EXPECT_EQ(line.Of("damaged").outcome, Outcome::ok);
  EXPECT_EQ(line.sent.size(), 2U);
  line.twin(0).manner.dead = true;
  line.Ask("silent", kRead);
  line.RunFor(2s);
  EXPECT_EQ(line.Of("silent").outcome, Outcome::no_reply);
  EXPECT_EQ(line.sent.size(), 3U);
}

TEST(PollerRouted, ARequestPastItsDeadlineIsNeverSent) {
  RoutedLine line;
  line.Ask("block", kBlock);
  line.Ask("short of time", kRead, 20, 2, Priority::normal, 50ms);
  line.RunFor(2s);
  EXPECT_EQ(line.Of("short of time").outcome, Outcome::no_reply);
  EXPECT_FALSE(line.Of("short of time").sent);
  EXPECT_THAT(line.Of("short of time").reason, HasSubstr("deadline"));
  EXPECT_THAT(line.Names(), ElementsAre("short of time", "block")) << "told in time";
  EXPECT_EQ(line.sent.size(), 1U);
}

TEST(PollerRouted, NoRequestIsSentAfterItsDeadlineWhenTheProgramResumes) {
  RoutedLine line;
  line.Ask("first", kRead);
  ASSERT_TRUE(line.RunUntil([&] { return line.replies.size() == 1; }, 1s));
  line.Ask("start", kStartDrive, 20, 2, Priority::normal, 50ms);
  line.Stop(1s, true);
  EXPECT_EQ(line.Of("start").outcome, Outcome::no_reply);
  EXPECT_FALSE(line.Of("start").sent);
  line.RunFor(1s);
  EXPECT_EQ(line.sent.size(), 1U);
}

TEST(PollerRouted, RequestsOfADisconnectedClientAreDropped) {
  RoutedLine line;
  line.Ask("under way", kBlock, 20, 1);
  line.RunFor(10ms);
  line.Ask("left", kStartDrive, 20, 2);
  line.Ask("stays", kRead, 20, 3);
  line.poller().Abandon(2, line.now());
  line.poller().Abandon(1, line.now());
  EXPECT_THAT(line.Names(), ElementsAre("left", "under way"));
  EXPECT_EQ(line.Of("left").outcome, Outcome::no_reply);
  EXPECT_FALSE(line.Of("left").sent);
  EXPECT_TRUE(line.Of("under way").sent);
  line.RunFor(2s);
  EXPECT_THAT(line.Names(), ElementsAre("left", "under way", "stays"));
  EXPECT_EQ(line.sent.size(), 2U);
}

TEST(PollerRouted, AWriteUnderWayMayEndBeforeThePortIsLent) {
  RoutedLine line;
  line.Ask("write", kStartDrive);
  line.Ask("read", kRead);
  ASSERT_TRUE(line.RunUntil([&] { return !line.sent.empty(); }, 1s));
  EXPECT_TRUE(line.poller().IsWriting());
  line.poller().WindUp();
  EXPECT_TRUE(line.RunUntil([&] { return !line.poller().IsWriting(); }, 1s));
  EXPECT_EQ(line.Of("write").outcome, Outcome::ok);
  EXPECT_EQ(line.sent.size(), 1U) << "nothing is begun";
}

TEST(PollerRouted, IdenticalReadsThatWaitShareAnExchange) {
  RoutedLine line;
  line.Ask("under way", kRead, 20, 1);
  line.Ask("a", kRead, 20, 2);
  line.Ask("b", kRead, 20, 3);
  line.RunFor(1s);
  EXPECT_EQ(line.sent.size(), 2U) << "not with the one under way: its answer may be older";
  EXPECT_FALSE(line.Of("a").shared);
  EXPECT_TRUE(line.Of("b").shared);
  EXPECT_EQ(line.Of("a").pdu, line.Of("b").pdu);
}

TEST(PollerRouted, ClientsOfOnePriorityShareTheLine) {
  RoutedLine line;
  BusyClients clients(line);
  for (int i = 0; i < 64; ++i) {
    clients.Add(ReadOf(static_cast<std::uint8_t>(i)), 20);
  }
  line.RunFor(60s);
  int sum = 0;
  for (std::size_t i = 0; i < 64; ++i) sum += clients.answered(i);
  ASSERT_GT(sum, 640);
  for (std::size_t i = 0; i < 64; ++i) EXPECT_NEAR(clients.answered(i), sum / 64, 1) << i;
}

TEST(PollerRouted, OneClientOfHighPriorityGetsHalfOfTheLine) {
  RoutedLine line;
  BusyClients clients(line);
  for (int i = 0; i < 20; ++i) {
    clients.Add(ReadOf(static_cast<std::uint8_t>(i)), 20,
                i == 7 ? Priority::high : Priority::normal);
  }
  clients.Add("04 00 00 00 01", 20, Priority::low);
  line.RunFor(60s);
  int sum = 0;
  for (std::size_t i = 0; i < 20; ++i) sum += clients.answered(i);
  EXPECT_NEAR(clients.answered(7), sum / 2, 1);
  EXPECT_EQ(clients.answered(20), 0) << "low: only when nothing else waits";
  EXPECT_EQ(clients.failed(20), 60s / 2500ms) << "told at its deadline";
}

TEST(PollerRouted, PollsAndRoutedRequestsTakeTurns) {
  config::Line settings = DriveLine({ToyDevice("module", "A", {"1", "2", "3", "4"})});
  settings.devices[0].poll = 10ms;
  settings.devices[0].protocol = "toy";
  RoutedLine line(std::move(settings));
  BusyClients clients(line);
  clients.Add(kRead, 20);
  clients.Add(kOther, 21);
  line.RunFor(30s);
  const int routed = clients.answered(0) + clients.answered(1);
  const auto polled = static_cast<int>(line.StatusOf(0).exchanges);
  EXPECT_NEAR(routed, polled, 0.02 * polled);
  EXPECT_EQ(line.QualityOf(0, 3), Quality::good);
}

TEST(PollerRouted, AWriteWaitsForNoPoll) {
  config::Line settings = DriveLine({ToyDevice("module", "A", {"1", "2", "3", "4"})});
  settings.devices[0].poll = 10ms;
  RoutedLine line(std::move(settings));
  line.RunFor(2s);
  const std::size_t before = line.sent.size();
  line.Ask("start", kStartDrive);
  line.RunFor(200ms);
  ASSERT_GT(line.sent.size(), before + 1);
  const auto wire = line.OnWire();
  EXPECT_TRUE(wire[before] == "14 06 00 00 00 02" || wire[before + 1] == "14 06 00 00 00 02");
}

TEST(PollerRouted, ADeadSlaveFailsQuicklyAndBarelySlowsTheOthers) {
  const auto answered_in_a_minute = [](bool dead) {
    RoutedLine line;
    line.twin(1).manner.dead = dead;
    BusyClients clients(line);
    clients.Add(kRead, 20);
    if (dead) {
      clients.Add(kRead, 21);
      clients.Add(kOther, 21);
    }
    line.RunFor(10s);
    const int before = clients.answered(0);
    line.RunFor(60s);
    if (dead) {
      EXPECT_GT(clients.failed(2), 1000);
    }
    return clients.answered(0) - before;
  };
  const int alone = answered_in_a_minute(false);
  EXPECT_GE(answered_in_a_minute(true), 0.97 * alone);
}

TEST(PollerRouted, ASlaveThatReturnsIsServedByTheNextProbe) {
  RoutedLine line;
  line.twin(0).manner.dead = true;
  BusyClients clients(line);
  clients.Add(kRead, 20);
  line.RunFor(20s);
  EXPECT_EQ(clients.answered(0), 0);
  ASSERT_FALSE(line.states.empty());
  EXPECT_EQ(line.states.back().device, kFirstSlave + 20);
  line.twin(0).manner.dead = false;
  line.RunFor(2s);
  EXPECT_GT(clients.answered(0), 20);
  EXPECT_EQ(line.states.back().to, DeviceState::online);
}

TEST(PollerRouted, AWriteToADeadSlaveWaitsForItsDeadlineAndGoesOutWhenTheSlaveReturns) {
  RoutedLine line;
  line.twin(0).manner.dead = true;
  for (int i = 0; i < 8; ++i) {
    line.Ask("read", kRead);
    line.RunFor(1s);
  }
  line.Ask("probe", kRead, 20, 1);
  line.Ask("start", kStartDrive, 20, 2);
  line.Ask("hopeless", kOther, 20, 3);
  EXPECT_EQ(line.Of("hopeless").outcome, Outcome::no_reply);
  EXPECT_THAT(line.Of("hopeless").reason, HasSubstr("slave 20 does not answer"));
  line.twin(0).manner.dead = false;
  line.RunFor(2s);
  EXPECT_EQ(line.Of("start").outcome, Outcome::ok);
}

TEST(PollerRouted, ABroadcastHasNoReplyAndIsFollowedByAPause) {
  RoutedLine line;
  line.Ask("all", kStartDrive, 0);
  line.Ask("read", kRead);
  line.RunFor(1s);
  EXPECT_EQ(line.Of("all").outcome, Outcome::ok);
  EXPECT_TRUE(line.Of("all").pdu.empty());
  EXPECT_EQ(ToHex(line.Of("read").pdu), "03 02 00 02") << "carried out";
  ASSERT_EQ(line.sent.size(), 2U);
  EXPECT_GE(line.sent[1].at - line.sent[0].at, 100ms);
}

TEST(PollerRouted, APolledDeviceAndARouteToItShareOneState) {
  RoutedLine line(DriveLine({Polled("20", 2, 10s)}), {});
  line.twin(0).values.Set(0, std::uint64_t{11});
  line.RunFor(5s);
  EXPECT_EQ(line.QualityOf(0, 0), Quality::good);
  line.Ask("read", kOther);
  line.RunFor(1s);
  EXPECT_EQ(line.Of("read").outcome, Outcome::ok);
  line.twin(0).manner.dead = true;
  line.RunFor(60s);
  EXPECT_EQ(line.StatusOf(0).state, DeviceState::offline);
  line.Ask("probe", kRead);
  line.Ask("told at once", kOther, 20, 2);
  EXPECT_EQ(line.Of("told at once").outcome, Outcome::no_reply);
}

TEST(PollerRouted, AnEchoDoesNotConfirmAWriteOnAnEchoingBus) {
  RoutedLine line(DriveLine(), {"20"});
  line.echo = [](View request) { return Bytes(request.begin(), request.end()); };
  line.Ask("read", kRead);
  line.RunFor(1s);
  EXPECT_EQ(line.Of("read").outcome, Outcome::ok);
  line.twin(0).manner.dead = true;
  line.Ask("start", kStartDrive);
  line.RunFor(2s);
  EXPECT_NE(line.Of("start").outcome, Outcome::ok);
}

}  // namespace
}  // namespace baudgate::bus
