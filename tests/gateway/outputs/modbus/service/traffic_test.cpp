// Counters of clients and routes.
// SPDX-License-Identifier: Apache-2.0
#include "gateway/outputs/modbus/service/traffic.h"

#include <fmt/format.h>
#include <gmock/gmock.h>

#include <algorithm>

#include "tests/gateway/outputs/modbus/service/service_fixture.h"

namespace baudgate::modbus {
namespace {

using testing::IsEmpty;
using testing::SizeIs;

class TrafficTest : public ServiceTest {
 protected:
  /// The identity that traffic.h promises.
  static void ExpectSum(const RouteCounters& counters, std::uint64_t under_way) {
    EXPECT_EQ(counters.requests, counters.ok + counters.refused + counters.denied +
                                     counters.no_reply + counters.expired + counters.busy +
                                     counters.dropped + counters.broadcasts + under_way);
  }
};

TEST_F(TrafficTest, RequestsOfAListenerAreCountedByFunctionAndAnswer) {
  Enter(wire_, config::Priority::high);
  Ask(1, "03 00 00 00 01");
  Ask(1, "03 00 00 00 01");
  Ask(1, "03 00 09 00 01");
  Ask(1, "6F");
  services_[0]->Close();
  std::vector<std::string> counts;
  for (const FunctionCount& count : Traffic().functions) {
    counts.push_back(fmt::format("{} {} {} {}", count.listener, count.function, count.exception,
                                 count.requests));
  }
  EXPECT_THAT(counts, testing::ElementsAre("127.0.0.1:1502 3 0 2", "127.0.0.1:1502 3 2 1",
                                           "127.0.0.1:1502 0 1 1"));
}

TEST_F(TrafficTest, AClientsRequestsAndBytes) {
  Add(1, 20, 20);
  Enter(wire_, config::Priority::high);
  const Now entered = Clocks();
  ASSERT_THAT(Traffic().clients, SizeIs(1));
  EXPECT_EQ(Traffic().clients[0].last_request, WallTime{});
  Ask(1, "03 00 00 00 01");
  Ask(1, "03 00 09 00 01");
  Ask(20, kRead);
  now_ += 2s;
  const ClientStatus client = Traffic().clients[0];
  EXPECT_EQ(client.id, drive_.Wait(0).client);
  EXPECT_EQ(client.peer, "10.0.0.7:40112");
  EXPECT_EQ(client.listener, "127.0.0.1:1502");
  EXPECT_EQ(client.priority, config::Priority::high);
  EXPECT_EQ(client.since, entered.wall);
  EXPECT_EQ(client.last_request, entered.wall);
  EXPECT_EQ(client.requests, 3U);
  EXPECT_EQ(client.exceptions, 1U);
  EXPECT_EQ(client.bytes_in, 36U);
  EXPECT_EQ(client.bytes_out, 11U + 9U);
  EXPECT_EQ(client.outstanding, 1U);
  drive_.Wait(0).done(SlaveException("83 02"));
  Settle();
  EXPECT_EQ(Traffic().clients[0].exceptions, 2U);
  EXPECT_EQ(Traffic().clients[0].bytes_out, 11U + 9U + 9U);
  EXPECT_EQ(Traffic().clients[0].outstanding, 0U);
  EXPECT_EQ(shared_->counters().Snapshot().exceptions, 2U);
}

TEST_F(TrafficTest, BytesOfRtuClientsAreThoseOfTheirFrames) {
  listener().framing = Framing::rtu;
  Ask(1, "03 00 00 00 01");
  EXPECT_EQ(Traffic().clients[0].bytes_in, 8U);
  EXPECT_EQ(Traffic().clients[0].bytes_out, 7U);
}

TEST_F(TrafficTest, EveryClientIsCountedByItself) {
  KeptWire other;
  Enter(wire_);
  Enter(other)->Handle(Frame(1, "03 00 00 00 01"), Clocks());
  ASSERT_THAT(Traffic().clients, SizeIs(2));
  EXPECT_LT(Traffic().clients[0].id, Traffic().clients[1].id);
  EXPECT_EQ(Traffic().clients[0].requests, 0U);
  EXPECT_EQ(Traffic().clients[1].requests, 1U);
  const std::uint64_t second = IdOf(1);
  services_[0]->Close();
  ASSERT_THAT(Traffic().clients, SizeIs(1));
  EXPECT_EQ(IdOf(0), second);
}

/// Whoever raises alarms hears how each ended, by the unit that the client has asked for.
TEST_F(TrafficTest, TheEndOfARoutedRequestIsTold) {
  Add(1, 20, 22).remap = 1;
  std::vector<std::string> told;
  links_.routed = [&told](const RoutedReport& end, Now) {
    told.push_back(end.route.Target() + " " + std::to_string(end.unit) + " " +
                   std::to_string(static_cast<int>(end.end)) + " " + end.reply.reason);
  };
  Ask(21, kRead);
  Ask(22, kRead);
  RoutedReply silence;
  silence.outcome = Outcome::no_reply;
  silence.reason = "no reply";
  silence.sent = true;
  drive_.Wait(0).done(SlaveException("83 02"));
  drive_.Wait(1).done(silence);
  Settle();
  EXPECT_THAT(told, testing::ElementsAre("line drive 21 1 ", "line drive 22 2 no reply"));
}

TEST_F(TrafficTest, EveryEndOfARoutedRequestIsCounted) {
  Add(1, 20, 22);
  config_.modbus.routes.back().remap = 1;
  Add(2, 30, 30);
  RoutedReply ok = GoodReply("03 02 00 07");
  ok.waited = 30ms;
  RoutedReply shared = ok;
  shared.shared = true;
  shared.waited = 10ms;
  // Two ask long ago, so that their answers come after the deadline.
  const std::size_t kLate[] = {5, 6};
  const RoutedReply replies[] = {ok,
                                 shared,
                                 SlaveException("83 02"),
                                 Trouble(Outcome::corrupt, "checksum"),
                                 Trouble(Outcome::line_down, "the port is closed", false),
                                 Trouble(Outcome::no_reply, "waited too long", false),
                                 Trouble(Outcome::no_reply, "silence"),
                                 Trouble(Outcome::no_reply, "the slave is absent", false)};
  std::size_t number = 0;
  for (const RoutedReply& reply : replies) {
    const bool late = std::ranges::find(kLate, number) != std::end(kLate);
    now_ -= late ? 1h : 0h;
    Ask(static_cast<std::uint8_t>(20 + number % 3), kRead);
    now_ += late ? 1h : 0h;
    drive_.Wait(number++).done(reply);
    Settle();
  }
  Ask(20, kRead);
  drive_.full = true;
  Ask(20, kRead);
  const TrafficStatus traffic = Traffic();
  ASSERT_THAT(traffic.routes, SizeIs(2)) << "none for broadcasts, as there were none";
  const RouteStatus& route = traffic.routes[0];
  EXPECT_EQ(route.units, "20-22");
  EXPECT_EQ(route.target, "line drive");
  EXPECT_EQ(route.requests, 10U);
  EXPECT_EQ(route.ok, 2U);
  EXPECT_EQ(route.refused, 1U);
  EXPECT_EQ(route.no_reply, 4U);
  EXPECT_EQ(route.expired, 1U);
  EXPECT_EQ(route.busy, 1U);
  EXPECT_EQ(route.shared, 1U);
  EXPECT_EQ(route.longest_wait, 30ms);
  EXPECT_EQ(route.total_wait, 40ms);
  EXPECT_EQ(route.last_trouble, "too many requests wait already");
  ExpectSum(route, 1);
  ASSERT_THAT(route.by_unit, SizeIs(3));
  EXPECT_EQ(route.by_unit.at(20).requests, 5U);
  EXPECT_EQ(route.by_unit.at(21).requests, 3U);
  ExpectSum(route.by_unit.at(20), 1);
  EXPECT_EQ(traffic.routes[1].requests, 0U);
  EXPECT_THAT(traffic.routes[1].by_unit, IsEmpty());
  services_[0]->Close();
  EXPECT_EQ(Traffic().routes[0].dropped, 1U);
  ExpectSum(Traffic().routes[0], 0);
}

TEST_F(TrafficTest, WhatTheListenerDoesNotPermitIsCounted) {
  Add(1, 20, 22);
  listener().permit = config::Permit::read;
  Ask(21, "06 00 08 00 07");
  const RouteStatus route = Traffic().routes.at(0);
  EXPECT_EQ(route.denied, 1U);
  EXPECT_EQ(route.by_unit.at(21).denied, 1U);
  EXPECT_EQ(route.last_trouble, "") << "the slave has none";
  ExpectSum(route, 0);
}

TEST(TrafficBookTest, APortsTimesAreTheCallers) {
  TrafficBook book;
  config::Listener listener;
  listener.path = "/dev/ttyUSB0";
  const std::size_t port = book.AddMaster(listener, WallTime(1h));
  const auto master = [&book] { return book.Status({}).masters.at(0); };
  EXPECT_EQ(master().since, WallTime(1h));
  book.ShowPort(port, true, "open", WallTime(2h));
  book.Heard(port, WallTime(3h));
  book.ShowPort(port, true, "still open", WallTime(4h));
  EXPECT_EQ(master().since, WallTime(2h)) << "since it is open";
  EXPECT_EQ(master().last_frame, WallTime(3h));
  book.HeardEcho(port);
  EXPECT_EQ(master().echoes, 1U);
  book.ShowPort(port, false, "gone", WallTime(5h));
  EXPECT_EQ(master().since, WallTime(5h));
}

TEST_F(TrafficTest, ASlavesExceptionIsNoTrouble) {
  Add(1, 20, 20);
  Ask(20, kRead);
  drive_.Wait(0).done(Trouble(Outcome::partial, "stopped mid-frame"));
  Ask(20, kRead);
  RoutedReply refused = SlaveException("83 02");
  refused.reason = "illegal data address";
  drive_.Wait(1).done(refused);
  Settle();
  EXPECT_EQ(Traffic().routes[0].last_trouble, "stopped mid-frame");
}

}  // namespace
}  // namespace baudgate::modbus
