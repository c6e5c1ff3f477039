// Clients of a Modbus TCP server behind the gateway: reads that they share, a full queue, leaving,
// threads.
// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <thread>
#include <utility>
#include <vector>

#include "gateway/bus/writes/route_queue.h"
#include "gateway/outputs/modbus/upstream/upstream_link.h"
#include "tests/gateway/outputs/modbus/upstream/upstream_fixture.h"

namespace baudgate::modbus {
namespace {

using test::RunReady;
using testing::IsEmpty;

TEST_F(UpstreamTest, IdenticalReadsThatWaitTogetherShareOneReply) {
  const Asked& first = Submit({.client = 1});
  const Asked& second = Submit({.client = 2});
  ASSERT_TRUE(server_.Wait(1));
  server_.Write("00 00 00 00 00 05 14 03 02 00 01");
  EXPECT_EQ(ToHex(Wait(first).pdu), "03 02 00 01");
  EXPECT_EQ(ToHex(Wait(second).pdu), "03 02 00 01");
  EXPECT_NE(first.reply.shared, second.reply.shared);
  EXPECT_EQ(server_.Requests().size(), 1U);
}

TEST_F(UpstreamTest, AForgottenClientIsNotSentFor) {
  FillTheWire();
  const Asked& gone = Submit({.client = 7});
  RunReady(io_);
  const Asked& waits = Submit({.pdu = "03 00 01 00 01", .client = 7});
  const Asked& stays = Submit({.pdu = "03 00 02 00 01", .client = 8});
  upstream_.Abandon(7);
  server_.Write("00 00 00 00 00 05 14 03 02 00 01");
  ASSERT_TRUE(server_.Wait(13));
  EXPECT_EQ(server_.Requests()[12], "00 0C 00 00 00 06 14 03 00 02 00 01");
  upstream_.Abandon(8);
  RunReady(io_);
  server_.Write("00 0C 00 00 00 05 14 03 02 00 02 00 01 00 00 00 05 14 03 02 00 03");
  Wait(asked_[1]);
  for (const Asked* asked : {&gone, &waits, &stays}) {
    EXPECT_EQ(asked->calls, 1);
    EXPECT_EQ(asked->reply.outcome, Outcome::no_reply);
    EXPECT_EQ(asked->reply.sent, asked != &waits && asked != &gone);
  }
  EXPECT_THAT(late_, IsEmpty()) << "it was waited for";
}

TEST_F(UpstreamTest, AFullQueueSaysNoUntilThereIsRoom) {
  FillTheWire();
  for (std::size_t i = 0; i < UpstreamQueue::kMostWaiting; ++i) {
    Submit({.pdu = "2B 0E 01 00", .client = i});
    if (i % 2 == 0) RunReady(io_);
  }
  EXPECT_FALSE(upstream_.Submit(Make({})));
  EXPECT_EQ(asked_.back().calls, 0);
  RunReady(io_);
  EXPECT_FALSE(upstream_.Submit(Make({})));
  upstream_.Abandon(5);
  RunReady(io_);
  EXPECT_TRUE(upstream_.Submit(Make({})));
  for (std::size_t i = 0; i < RouteQueue::kKept; ++i) Submit({.pdu = "06 00 01 00 01"});
  EXPECT_FALSE(upstream_.Submit(Make({.pdu = "06 00 01 00 01"}))) << "their own places are full";
}

TEST_F(UpstreamTest, AnyThreadMayAsk) {
  std::vector<std::thread> threads;
  std::vector<RoutedRequest> requests;
  for (std::uint8_t i = 0; i < 16; ++i) requests.push_back(Make({.slave = i, .client = i}));
  for (RoutedRequest& request : requests) {
    threads.emplace_back([this, &request] {
      const std::uint64_t client = request.client;
      EXPECT_TRUE(upstream_.Submit(std::move(request)));
      if (client % 4 == 0) upstream_.Abandon(client);
    });
  }
  ASSERT_TRUE(server_.Wait(12));
  for (std::thread& thread : threads) thread.join();
}

}  // namespace
}  // namespace baudgate::modbus
