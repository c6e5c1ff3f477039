// Requests to a Modbus TCP server and their replies: what passes as it is, and what is no reply.
// SPDX-License-Identifier: Apache-2.0
#include "gateway/outputs/modbus/upstream/upstream.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>

#include "tests/gateway/outputs/modbus/server/captured_log.h"
#include "tests/gateway/outputs/modbus/upstream/upstream_fixture.h"

namespace baudgate::modbus {
namespace {

using test::RunReady;
using test::RunUntil;
using testing::HasSubstr;
using testing::IsEmpty;

TEST_F(UpstreamTest, RequestAndReplyPassAsTheyAre) {
  const Asked& asked = Submit();
  ASSERT_TRUE(server_.Wait(1));
  EXPECT_EQ(server_.Requests()[0], "00 00 00 00 00 06 14 03 00 C8 00 01");
  server_.Write("00 00 00 00 00 05 14 03 02 09 C4");
  const RoutedReply& reply = Wait(asked);
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
  const RoutedReply& reply = Wait(asked);
  EXPECT_EQ(reply.outcome, Outcome::refused);
  EXPECT_EQ(ToHex(reply.pdu), "83 02");
}

TEST_F(UpstreamTest, RepliesFindTheirRequestsInAnyOrder) {
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
  const char* reply;   ///< behind its id: the header counts more than there is
  const char* passed;  ///< PDU
  Outcome outcome = Outcome::ok;
};

/// Behind each stands the next one, with and without the bytes that the header has counted.
TEST_F(UpstreamTest, TheSizeThatFunctionAndRequestFixStandsAboveTheHeader) {
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

/// Two in one piece: the header of the second is found.
TEST_F(UpstreamTest, BehindAMisframedReplyTheNextHeaderIsFound) {
  const Asked& first = Submit();
  const Asked& second = Submit({.slave = 21});
  ASSERT_TRUE(server_.Wait(2));
  server_.Write("00 00 00 00 00 04 14 83 02 00 01 00 00 00 05 15 03 02 00 07");
  EXPECT_EQ(ToHex(Wait(first).pdu), "83 02");
  EXPECT_EQ(ToHex(Wait(second).pdu), "03 02 00 07");
}

TEST_F(UpstreamTest, OtherUnitsAndFunctionsAreNoReply) {
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

/// Its transaction id says which request it answers; its client judges.
TEST_P(OddReplyTest, PassesAsItCame) {
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

TEST_F(UpstreamTest, WhatNobodyKnowsPassesAsItIs) {
  const Asked& asked = Submit({.slave = 250, .pdu = "64 DE AD"});
  ASSERT_TRUE(server_.Wait(1));
  server_.Write("00 00 00 00 00 05 FA 64 01 02 03");
  EXPECT_EQ(ToHex(Wait(asked).pdu), "64 01 02 03");
}

TEST_F(UpstreamTest, AnUnknownIdIsDropped) {
  const Asked& asked = Submit();
  ASSERT_TRUE(server_.Wait(1));
  server_.Write("00 07 00 00 00 05 14 03 02 09 C4 00 00 00 00 00 05 14 03 02 00 01");
  EXPECT_EQ(ToHex(Wait(asked).pdu), "03 02 00 01");
  EXPECT_THAT(late_, IsEmpty()) << "nobody has ever waited for it";
}

TEST_F(UpstreamTest, ABroadcastIsNotWaitedFor) {
  const Asked& all = Submit({.slave = 0, .pdu = "06 00 08 00 00", .broadcast = true});
  const RoutedReply& reply = Wait(all);
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

TEST_F(UpstreamTest, AWriteToUnitZeroThatIsNoBroadcastIsAnswered) {
  const Asked& write = Submit({.slave = 0, .pdu = "06 00 08 00 02"});
  const Asked& other = Submit({.slave = 20});
  ASSERT_TRUE(server_.Wait(2)) << "and holds up no other unit";
  EXPECT_EQ(write.calls, 0);
  server_.Write("00 00 00 00 00 06 00 06 00 08 00 02 00 01 00 00 00 05 14 03 02 00 01");
  EXPECT_EQ(ToHex(Wait(write).pdu), "06 00 08 00 02");
  EXPECT_EQ(Wait(other).outcome, Outcome::ok);
}

TEST_F(UpstreamTest, AServerThatSendsGarbageBehindGoodFramesFillsNoLog) {
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
  // Connected, and sent what is no Modbus TCP.
  EXPECT_LE(log.CountLines("server 127.0.0.1:" + std::to_string(server_.port())), 2);
}

}  // namespace
}  // namespace baudgate::modbus
