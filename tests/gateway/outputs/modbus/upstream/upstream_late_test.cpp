// Deadlines of requests to a Modbus TCP server, and replies that come after them.
// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <memory>

#include "gateway/outputs/modbus/service/router.h"
#include "gateway/outputs/modbus/service/traffic_book.h"
#include "tests/gateway/outputs/modbus/upstream/upstream_fixture.h"

namespace baudgate::modbus {
namespace {

using test::RunReady;
using test::RunUntil;
using testing::ElementsAre;
using testing::HasSubstr;

TEST_F(UpstreamTest, ALateReplyIsNotTheNextOnes) {
  const Asked& slow = SendInVain();
  EXPECT_THAT(slow.reply.reason, HasSubstr("did not answer in time"));
  const Asked& next = Submit();
  ASSERT_TRUE(server_.Wait(2));
  server_.Write("00 00 00 00 00 05 14 03 02 AA AA 00 01 00 00 00 05 14 03 02 BB BB");
  EXPECT_EQ(ToHex(Wait(next).pdu), "03 02 BB BB");
  EXPECT_EQ(slow.calls, 1);
  EXPECT_THAT(late_, ElementsAre(20));
  const Asked& last = Submit();
  ASSERT_TRUE(server_.Wait(3));
  server_.Write("00 00 00 00 00 05 14 03 02 AA AA 00 02 00 00 00 05 14 03 02 CC CC");
  EXPECT_EQ(ToHex(Wait(last).pdu), "03 02 CC CC");
  EXPECT_THAT(late_, ElementsAre(20)) << "a copy is not counted";
}

TEST_F(UpstreamTest, WhatCameLateIsShownAtTheRoutesToThatUnit) {
  std::vector<config::Route> routes;
  const auto add = [&routes](std::uint16_t port, std::uint8_t first, std::uint8_t last) {
    config::Route& route = routes.emplace_back();
    route.host = "127.0.0.1";
    route.port = port;
    route.first = first;
    route.last = last;
  };
  add(server_.port(), 18, 20);
  add(server_.port(), 40, 41);
  routes.back().remap = 19;
  add(server_.port(), 21, 30);
  add(1, 20, 20);
  const RouteList list(routes);
  const auto book = std::make_shared<TrafficBook>();
  book->Show(list);
  RouteTargets targets(list, {});
  targets.Open(io_, book);
  ASSERT_TRUE(targets.of(1)->Submit(Make({.within = 300ms})));
  ASSERT_TRUE(server_.Wait(1));
  Wait(asked_[0]);
  server_.Write("00 00 00 00 00 05 14 03 02 09 C4");
  const auto late = [&](std::size_t route) {
    return book->Status(ReadClocks()).routes[route].late;
  };
  ASSERT_TRUE(RunUntil(io_, [&] { return late(0) == 1; }));
  EXPECT_EQ(late(1), 1U);
  EXPECT_EQ(late(2), 0U) << "another unit";
  EXPECT_EQ(late(3), 0U) << "another server";
  targets.Close();
}

TEST_F(UpstreamTest, NothingIsSentAfterItsDeadline) {
  const Asked& late = Submit({.pdu = "06 00 08 00 02", .within = -1s});
  const RoutedReply& reply = Wait(late);
  EXPECT_EQ(reply.outcome, Outcome::no_reply);
  EXPECT_FALSE(reply.sent);
  EXPECT_THAT(reply.reason, HasSubstr("deadline"));
  RunReady(io_);
  EXPECT_EQ(server_.accepted(), 0U);
}

TEST_F(UpstreamTest, WhatWaitsForTheWireExpires) {
  FillTheWire();
  const Asked& late = Submit({.within = 1ms});
  EXPECT_FALSE(Wait(late).sent);
  server_.Write("00 00 00 00 00 05 14 03 02 00 01");
  Wait(asked_[0]);
  RunReady(io_);
  EXPECT_EQ(server_.Requests().size(), kReadsOnWire);
}

}  // namespace
}  // namespace baudgate::modbus
