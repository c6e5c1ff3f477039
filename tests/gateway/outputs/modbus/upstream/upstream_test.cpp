// Tests of requests to a Modbus TCP server and their replies.
// SPDX-License-Identifier: Apache-2.0
#include "gateway/outputs/modbus/upstream/upstream.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <memory>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "gateway/bus/writes/route_queue.h"
#include "gateway/outputs/modbus/service/router.h"
#include "gateway/outputs/modbus/service/traffic_book.h"
#include "gateway/outputs/modbus/upstream/upstream_link.h"
#include "tests/gateway/outputs/modbus/server/captured_log.h"
#include "tests/gateway/outputs/modbus/upstream/upstream_fixture.h"

namespace baudgate::modbus {
namespace {

using test::RunReady;
using test::RunUntil;
using testing::HasSubstr;
using testing::IsEmpty;

TEST_F(UpstreamTest, RequestAndReplyPassUnchanged) {
  const Asked& asked = Submit();
  ASSERT_TRUE(server_.Wait(1));
  EXPECT_EQ(server_.Requests()[0], "00 00 00 00 00 06 14 03 00 C8 00 01");
  server_.Write("00 00 00 00 00 05 14 03 02 09 C4");
  const bus::RoutedReply& reply = Wait(asked);
  EXPECT_EQ(reply.outcome, Outcome::ok);
  EXPECT_EQ(ToHex(reply.pdu), "03 02 09 C4");
  EXPECT_TRUE(reply.sent);
  EXPECT_FALSE(reply.shared);
  EXPECT_EQ(server_.accepted(), 1U);
}

TEST_F(UpstreamTest, AnExceptionIsPassedOn) {
  const Asked& asked = Submit();
  ASSERT_TRUE(server_.Wait(1));
  server_.Write("00 00 00 00 00 03 14 83 02");
  const bus::RoutedReply& reply = Wait(asked);
  EXPECT_EQ(reply.outcome, Outcome::refused);
  EXPECT_EQ(ToHex(reply.pdu), "83 02");
}

TEST_F(UpstreamTest, RepliesAreMatchedToRequestsInAnyOrder) {
  const Asked& first = Submit({.slave = 1});
  const Asked& second = Submit({.slave = 2});
  ASSERT_TRUE(server_.Wait(2));
  server_.Write("00 01 00 00 00 05 02 03 02 00 22 00 00 00 00 00 05 01 03 02 00 11");
  EXPECT_EQ(ToHex(Wait(second).pdu), "03 02 00 22");
  EXPECT_EQ(ToHex(Wait(first).pdu), "03 02 00 11");
}

TEST_F(UpstreamTest, AReplyMayComeInAnyPieces) {
  constexpr std::size_t kSize = 11;
  for (std::size_t cut = 0; cut <= kSize; ++cut) {
    const Asked& asked = Submit();
    ASSERT_TRUE(server_.Wait(cut + 1));
    const std::string id = HexByte(static_cast<std::uint8_t>(cut));
    const Bytes whole = ParseHex("00 " + id + " 00 00 00 05 14 03 02 00 " + id).value();
    auto& session = server_.session(0);
    if (cut == kSize) {
      for (const std::uint8_t byte : whole) {
        session.Write({byte});
        RunReady(io_);
      }
    } else {
      session.Write(Bytes(whole.begin(), whole.begin() + static_cast<std::ptrdiff_t>(cut)));
      RunReady(io_);
      EXPECT_EQ(asked.calls, 0);
      session.Write(Bytes(whole.begin() + static_cast<std::ptrdiff_t>(cut), whole.end()));
    }
    EXPECT_EQ(ToHex(Wait(asked).pdu), "03 02 00 " + id);
  }
}

struct Misframed {
  const char* request;
  /// The reply without its transaction id; the header announces more bytes than the PDU has.
  const char* reply;
  const char* passed;
  Outcome outcome = Outcome::ok;
};

TEST_F(UpstreamTest, AKnownReplySizeOverridesTheHeader) {
  const Misframed kCases[] = {
      {"03 00 C8 00 01", "00 00 00 04 14 83 02", "83 02", Outcome::refused},
      {"03 00 C8 00 01", "00 00 00 06 14 03 02 09 C4", "03 02 09 C4"},
      {"06 00 08 00 02", "00 00 00 07 14 06 00 08 00 02", "06 00 08 00 02"},
      {"10 00 08 00 01 02 00 07", "00 00 00 07 14 10 00 08 00 01", "10 00 08 00 01"},
      {"64 01", "00 00 00 04 14 E4 01", "E4 01", Outcome::refused},
  };
  for (const char* filler : {"", " 55", " 00"}) {
    for (const Misframed& one : kCases) {
      SCOPED_TRACE(one.reply);
      const Asked& asked = Submit({.pdu = one.request});
      ASSERT_TRUE(server_.Wait(asked_.size()));
      server_.Write(server_.Requests().back().substr(0, 6) + one.reply + filler);
      EXPECT_EQ(Wait(asked).outcome, one.outcome);
      EXPECT_EQ(ToHex(asked.reply.pdu), one.passed);
    }
  }
  EXPECT_EQ(server_.accepted(), 1U);
}

TEST_F(UpstreamTest, TheHeaderBehindAMisframedReplyIsFound) {
  const Asked& first = Submit();
  const Asked& second = Submit({.slave = 21});
  ASSERT_TRUE(server_.Wait(2));
  server_.Write("00 00 00 00 00 04 14 83 02 00 01 00 00 00 05 15 03 02 00 07");
  EXPECT_EQ(ToHex(Wait(first).pdu), "83 02");
  EXPECT_EQ(ToHex(Wait(second).pdu), "03 02 00 07");
}

TEST_F(UpstreamTest, RepliesOfOtherUnitsAndFunctionsAreUnexpected) {
  using Case = std::pair<std::string, std::string>;
  for (const auto& [reply, reason] :
       {Case{"00 00 00 00 00 05 15 03 02 09 C4", "answered for unit 21"},
        Case{"00 01 00 00 00 05 14 04 02 09 C4", "sent an answer that does not fit"},
        Case{"00 02 00 00 00 02 14 83", "sent an answer that does not fit"}}) {
    const Asked& asked = Submit();
    ASSERT_TRUE(server_.Wait(asked_.size()));
    server_.Write(reply);
    EXPECT_EQ(Wait(asked).outcome, Outcome::unexpected) << reply;
    EXPECT_TRUE(asked.reply.pdu.empty());
    EXPECT_THAT(asked.reply.reason, HasSubstr(reason));
  }
}

struct OddReply {
  const char* request;
  const char* reply;
};

class OddReplyTest : public UpstreamTest, public testing::WithParamInterface<OddReply> {};

TEST_P(OddReplyTest, PassesUnchanged) {
  const std::string pdu = GetParam().reply;
  const auto size = static_cast<std::uint8_t>((pdu.size() + 1) / 3 + 1);
  const Asked& asked = Submit({.pdu = GetParam().request});
  ASSERT_TRUE(server_.Wait(1));
  server_.Write("00 00 00 00 00 " + HexByte(size) + " 14 " + pdu);
  EXPECT_EQ(Wait(asked).outcome, Outcome::ok);
  EXPECT_EQ(ToHex(asked.reply.pdu), pdu);
}

INSTANTIATE_TEST_SUITE_P(
    All, OddReplyTest,
    testing::Values(OddReply{"03 00 C8 00 01", "03 02 01"}, OddReply{"03 00 C8 00 01", "03"},
                    OddReply{"03 13 89 00 01", "03 04 00 01 00 02"},
                    OddReply{"01 00 00 00 09", "01 01 FF"},
                    OddReply{"06 00 0D 00 6C", "06 00 0D 00 64"},
                    OddReply{"10 00 08 00 01 02 00 07", "10 00 08 00 01 02 00 07"},
                    OddReply{"08 00 15 00 03", "08 00 15 00 03 00 04 00 01 00 02"}));

TEST_F(UpstreamTest, AnUnknownFunctionPassesUnchanged) {
  const Asked& asked = Submit({.slave = 250, .pdu = "64 DE AD"});
  ASSERT_TRUE(server_.Wait(1));
  server_.Write("00 00 00 00 00 05 FA 64 01 02 03");
  EXPECT_EQ(ToHex(Wait(asked).pdu), "64 01 02 03");
}

TEST_F(UpstreamTest, AReplyWithAnUnknownIdIsDropped) {
  const Asked& asked = Submit();
  ASSERT_TRUE(server_.Wait(1));
  server_.Write("00 07 00 00 00 05 14 03 02 09 C4 00 00 00 00 00 05 14 03 02 00 01");
  EXPECT_EQ(ToHex(Wait(asked).pdu), "03 02 00 01");
  EXPECT_THAT(late_, IsEmpty()) << "nobody has ever waited for it";
}

TEST_F(UpstreamTest, ABroadcastIsNotWaitedFor) {
  const Asked& all = Submit({.slave = 0, .pdu = "06 00 08 00 00", .broadcast = true});
  const bus::RoutedReply& reply = Wait(all);
  EXPECT_EQ(reply.outcome, Outcome::ok);
  EXPECT_TRUE(reply.pdu.empty());
  EXPECT_TRUE(reply.sent);
  ASSERT_TRUE(server_.Wait(1));
  EXPECT_EQ(server_.Requests()[0], "00 00 00 00 00 06 00 06 00 08 00 00");
  server_.Write("00 00 00 00 00 06 00 06 00 08 00 00");
  const Asked& read = Submit({.slave = 0});
  ASSERT_TRUE(server_.Wait(2));
  server_.Write("00 01 00 00 00 05 00 03 02 00 01");
  EXPECT_EQ(ToHex(Wait(read).pdu), "03 02 00 01") << "unit 0 is the server itself";
  EXPECT_THAT(late_, IsEmpty()) << "nobody waits for its answer";
}

TEST_F(UpstreamTest, APlainWriteToUnitZeroIsAnswered) {
  const Asked& write = Submit({.slave = 0, .pdu = "06 00 08 00 02"});
  const Asked& other = Submit({.slave = 20});
  ASSERT_TRUE(server_.Wait(2)) << "and holds up no other unit";
  EXPECT_EQ(write.calls, 0);
  server_.Write("00 00 00 00 00 06 00 06 00 08 00 02 00 01 00 00 00 05 14 03 02 00 01");
  EXPECT_EQ(ToHex(Wait(write).pdu), "06 00 08 00 02");
  EXPECT_EQ(Wait(other).outcome, Outcome::ok);
}

TEST_F(UpstreamTest, GarbageBehindGoodFramesDoesNotFloodTheLog) {
  CapturedLog log;
  constexpr std::size_t kTimes = 10;
  for (std::size_t i = 0; i < kTimes; ++i) {
    const Asked& good = Submit();
    ASSERT_TRUE(server_.Wait(1, i));
    const std::string id = server_.Requests(i)[0].substr(0, 5);
    server_.Write(id + " 00 00 00 05 14 03 02 09 C4 00 00 FF FF 00 00", i);
    EXPECT_EQ(Wait(good).outcome, Outcome::ok);
    ASSERT_TRUE(RunUntil(io_, [&] { return server_.session(i).ended(); }));
  }
  // At most two lines: the server is connected, and sends bytes that are not Modbus TCP.
  EXPECT_LE(log.CountLines("server 127.0.0.1:" + std::to_string(server_.port())), 2);
}

using testing::ElementsAre;

TEST_F(UpstreamTest, ALateReplyIsNotTakenForTheNextRequest) {
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

TEST_F(UpstreamTest, ALateReplyIsCountedAtTheRoutesToItsUnit) {
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
  const bus::RoutedReply& reply = Wait(late);
  EXPECT_EQ(reply.outcome, Outcome::no_reply);
  EXPECT_FALSE(reply.sent);
  EXPECT_THAT(reply.reason, HasSubstr("deadline"));
  RunReady(io_);
  EXPECT_EQ(server_.accepted(), 0U);
}

TEST_F(UpstreamTest, AWaitingRequestExpires) {
  FillTheWire();
  const Asked& late = Submit({.within = 1ms});
  EXPECT_FALSE(Wait(late).sent);
  server_.Write("00 00 00 00 00 05 14 03 02 00 01");
  Wait(asked_[0]);
  RunReady(io_);
  EXPECT_EQ(server_.Requests().size(), kReadsOnWire);
}

TEST_F(UpstreamTest, TwelveReadsAreSentAndFurtherReadsWaitByPriority) {
  FillTheWire();
  Submit({.slave = 30, .pdu = "03 00 0A 00 01", .priority = config::Priority::low});
  Submit({.slave = 30, .pdu = "03 00 0B 00 01"});
  Submit({.slave = 30, .pdu = "03 00 0C 00 01", .priority = config::Priority::high});
  RunReady(io_);
  ASSERT_EQ(server_.Requests().size(), 12U);
  std::size_t sent = 12;
  for (const std::string id : {"04", "05", "06"}) {
    server_.Write("00 " + id + " 00 00 00 05 15 03 02 00 01");
    ASSERT_TRUE(server_.Wait(++sent));
  }
  const auto requests = server_.Requests();
  EXPECT_THAT(requests[12], HasSubstr("03 00 0C"));
  EXPECT_THAT(requests[13], HasSubstr("03 00 0B"));
  EXPECT_THAT(requests[14], HasSubstr("03 00 0A"));
}

TEST_F(UpstreamTest, WritesDoNotWaitForUnansweredReads) {
  FillTheWire();
  for (std::uint8_t unit = 40; unit < 48; ++unit) Submit({.slave = unit});
  RunReady(io_);
  Submit({.slave = 20, .pdu = "06 00 08 00 00"});
  Submit({.slave = 30, .pdu = "06 00 08 00 00"});
  ASSERT_TRUE(server_.Wait(kReadsOnWire + 2));
  EXPECT_EQ(server_.Requests()[12], "00 0C 00 00 00 06 14 06 00 08 00 00");
  EXPECT_EQ(server_.Requests()[13], "00 0D 00 00 00 06 1E 06 00 08 00 00");
}

TEST_F(UpstreamTest, AUnitHasFourPendingReadsAndASilentUnitOne) {
  const auto read = [this](std::uint8_t unit, int start, Duration within = 1h) {
    Submit({.slave = unit,
            .pdu = "03 01 " + HexByte(static_cast<std::uint8_t>(start)) + " 00 01",
            .within = within});
  };
  for (int i = 0; i < 6; ++i) read(20, i, 300ms);
  read(21, 0);
  ASSERT_TRUE(server_.Wait(5));
  EXPECT_THAT(server_.Requests()[4], HasSubstr(" 15 03 01 00")) << "others do not wait";
  server_.Write("00 04 00 00 00 05 15 03 02 00 01");
  for (std::size_t i = 0; i < 7; ++i) Wait(asked_[i]);
  ASSERT_TRUE(asked_[3].reply.sent) << "the machine stood still for 300 ms";
  std::size_t sent = server_.Requests().size();
  for (int i = 0; i < 6; ++i) read(20, 10 + i);
  read(21, 1);
  ASSERT_TRUE(server_.Wait(sent + 2));
  RunReady(io_);
  ASSERT_EQ(server_.Requests().size(), sent + 2);
  const std::string id = server_.Requests()[sent].substr(0, 5);
  server_.Write(id + " 00 00 00 05 14 03 02 00 01");
  ASSERT_TRUE(server_.Wait(sent + 2 + RequestsOnWire::kMostPerUnit)) << "it answers again";
}

TEST_F(UpstreamTest, AWriteWaitsForThePreviousWriteToItsUnit) {
  const Asked& start = Submit({.pdu = "06 00 08 00 02", .client = 1});
  Submit({.pdu = "06 00 08 00 00", .client = 2, .priority = config::Priority::high});
  Submit({.slave = 21, .pdu = "06 00 08 00 07", .client = 2});
  ASSERT_TRUE(server_.Wait(2));
  RunReady(io_);
  ASSERT_EQ(server_.Requests().size(), 2U);
  EXPECT_EQ(server_.Requests()[0], "00 00 00 00 00 06 14 06 00 08 00 02");
  EXPECT_EQ(server_.Requests()[1], "00 01 00 00 00 06 15 06 00 08 00 07");
  server_.Write("00 00 00 00 00 06 14 06 00 08 00 02");
  EXPECT_EQ(Wait(start).outcome, Outcome::ok);
  ASSERT_TRUE(server_.Wait(3));
  EXPECT_EQ(server_.Requests()[2], "00 02 00 00 00 06 14 06 00 08 00 00");
}

constexpr const char* kReply = "00 00 00 00 00 05 14 03 02 00 07";

class UpstreamRest : public UpstreamTest {
 protected:
  bool RunUntilDisconnected() {
    return test::RunUntil(io_, [&] { return server_.session(0).ended(); });
  }
};

TEST_F(UpstreamRest, AnswersPendingRequestsAndDisconnects) {
  const Asked& asked = Submit();
  ASSERT_TRUE(server_.Wait(1));
  upstream_.Rest();
  test::RunReady(io_);
  EXPECT_FALSE(server_.session(0).ended());
  server_.Write(kReply);
  EXPECT_EQ(ToHex(Wait(asked).pdu), "03 02 00 07");
  EXPECT_TRUE(RunUntilDisconnected());
}

TEST_F(UpstreamRest, DisconnectsAtOnceWithoutPendingRequests) {
  const Asked& asked = Submit();
  ASSERT_TRUE(server_.Wait(1));
  server_.Write(kReply);
  Wait(asked);
  upstream_.Rest();
  EXPECT_TRUE(RunUntilDisconnected());
}

TEST_F(UpstreamRest, DisconnectsWhenTheLastDeadlineHasPassed) {
  SendInVain();
  const Asked& asked = Submit({.within = 50ms});
  upstream_.Rest();
  EXPECT_EQ(Wait(asked).outcome, Outcome::no_reply);
  EXPECT_TRUE(RunUntilDisconnected());
}

TEST_F(UpstreamRest, EndsWithTheNextRoute) {
  Submit();
  ASSERT_TRUE(server_.Wait(1));
  upstream_.Rest();
  upstream_.Start();
  server_.Write(kReply);
  Wait(asked_[0]);
  test::RunReady(io_);
  EXPECT_FALSE(server_.session(0).ended());
  upstream_.Rest();
  EXPECT_TRUE(RunUntilDisconnected());
  upstream_.Start();
  Submit();
  EXPECT_TRUE(server_.Wait(1, 1)) << "a new connection";
}

TEST_F(UpstreamTest, WaitingIdenticalReadsShareOneReply) {
  const Asked& first = Submit({.client = 1});
  const Asked& second = Submit({.client = 2});
  ASSERT_TRUE(server_.Wait(1));
  server_.Write("00 00 00 00 00 05 14 03 02 00 01");
  EXPECT_EQ(ToHex(Wait(first).pdu), "03 02 00 01");
  EXPECT_EQ(ToHex(Wait(second).pdu), "03 02 00 01");
  EXPECT_NE(first.reply.shared, second.reply.shared);
  EXPECT_EQ(server_.Requests().size(), 1U);
}

TEST_F(UpstreamTest, RequestsOfAForgottenClientAreNotSent) {
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

TEST_F(UpstreamTest, AHostWithTooManyRequestsIsRefusedUntilSomeAreAnswered) {
  FillTheWire();
  std::uint64_t clients = 0;
  while (upstream_.Submit(Make({.pdu = "2B 0E 01 00", .client = ++clients}))) {
    ASSERT_LT(clients, UpstreamQueue::kMostWaiting);
    if (clients % 2 == 0) RunReady(io_);
  }
  EXPECT_EQ(asked_.back().calls, 0);
  RunReady(io_);
  EXPECT_FALSE(upstream_.Submit(Make({})));
  EXPECT_TRUE(upstream_.Submit(Make({.host = 2})));
  upstream_.Abandon(5);
  upstream_.Abandon(6);
  RunReady(io_);
  EXPECT_TRUE(upstream_.Submit(Make({})));
  std::size_t writes = 0;
  while (upstream_.Submit(Make({.pdu = "06 00 01 00 01"}))) ++writes;
  EXPECT_GE(writes, bus::RouteQueue::kKept);
  EXPECT_LE(writes, bus::RouteQueue::kKept + UpstreamQueue::kMostWaiting / 4);
}

TEST_F(UpstreamTest, AnyThreadMayAsk) {
  std::vector<std::thread> threads;
  std::vector<bus::RoutedRequest> requests;
  for (std::uint8_t i = 0; i < 16; ++i) requests.push_back(Make({.slave = i, .client = i}));
  for (bus::RoutedRequest& request : requests) {
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
