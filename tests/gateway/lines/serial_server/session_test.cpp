// One client of a port: when it asks for the port, what reaches the other side, and who waits for
// whom.
// SPDX-License-Identifier: Apache-2.0
#include "gateway/lines/serial_server/session.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "gateway/base/text.h"
#include "tests/gateway/lines/serial_server/fake_port.h"

namespace baudgate::serial_server {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using Mode = config::PortServer::Mode;

constexpr Duration kIdle = 1min;

struct FakeConnection final : Session::Connection {
  void Send(View bytes) override {
    Append(sent, bytes);
    if (!reads) held += bytes.size();
  }
  std::size_t unsent() const override { return held; }
  void Pause(bool on) override { paused = on; }

  Bytes sent;
  bool reads = true;
  std::size_t held = 0;
  bool paused = false;
};

class SessionTest : public testing::Test {
 protected:
  explicit SessionTest(Mode mode = Mode::raw)
      : session_({.mode = mode, .began = now_}, kIdle, "baudgate", client_) {}

  void Begin() { session_.Begin(port_, {}, now_); }
  void FromClient(const Bytes& bytes) { session_.OnClient(bytes, now_); }
  void FromPort(const Bytes& bytes) { session_.OnPort(bytes, now_); }
  void Pass(Duration time) {
    const Instant until = now_.instant + time;
    while (!session_.over() && session_.Deadline() <= until) {
      now_.instant = std::max(now_.instant, *session_.Deadline());
      session_.OnTimer(now_);
    }
    now_.instant = until;
  }
  std::string over() const { return session_.over().value_or(""); }

  test::FakePort port_;
  FakeConnection client_;
  Now now_{Instant() + 1h, {}};
  Session session_;
};

struct Rfc2217 : SessionTest {
  Rfc2217() : SessionTest(Mode::rfc2217) { client_.sent.clear(); }
};

TEST_F(SessionTest, AsksForThePortWithItsFirstByte) {
  EXPECT_FALSE(session_.asks());
  FromClient({1, 2});
  EXPECT_TRUE(session_.asks());
  EXPECT_TRUE(client_.paused) << "what it sends before it has the port is bounded";
  Begin();
  EXPECT_THAT(port_.sent, ElementsAre(1, 2));
  EXPECT_FALSE(client_.paused);
}

TEST_F(SessionTest, PassesEveryByteOn) {
  Begin();
  Bytes all(256);
  for (std::size_t i = 0; i < all.size(); ++i) all[i] = static_cast<std::uint8_t>(i);
  FromClient(all);
  FromPort(all);
  EXPECT_EQ(port_.sent, all);
  EXPECT_EQ(client_.sent, all);
  EXPECT_EQ(session_.visit().to_port, 256U);
  EXPECT_EQ(session_.visit().from_port, 256U);
}

TEST_F(SessionTest, TheClientWaitsForThePort) {
  Begin();
  port_.takes = false;
  FromClient(Bytes(Session::kMostForPort + 1));
  EXPECT_TRUE(client_.paused);
  port_.unsent = 0;
  session_.OnPortRoom();
  EXPECT_FALSE(client_.paused);
}

TEST_F(SessionTest, ThePortWaitsForAClientThatDoesNotRead) {
  Begin();
  client_.reads = false;
  FromPort(Bytes(Session::kMostForClient + 1));
  EXPECT_TRUE(port_.paused);
  client_.held = 0;
  session_.OnClientRoom();
  EXPECT_FALSE(port_.paused);
}

TEST_F(SessionTest, EndsWhereNobodySaysAnything) {
  Begin();
  Pass(kIdle - 1s);
  FromPort({1});
  Pass(kIdle - 1s);
  FromClient({1});
  Pass(kIdle - 1s);
  EXPECT_EQ(over(), "");
  Pass(1s);
  EXPECT_EQ(over(), "nothing was said for 1min");
}

TEST_F(SessionTest, EndsBeforeItHasThePortLikewise) {
  Pass(kIdle);
  EXPECT_EQ(over(), "nothing was said for 1min");
}

TEST_F(SessionTest, LeavesAtOnceWhereNothingIsToBeSent) {
  Begin();
  session_.OnClientEnd(now_);
  EXPECT_EQ(over(), "it has left");
}

TEST_F(SessionTest, LeavesWhenThePortHasSentAll) {
  Begin();
  port_.takes = false;
  FromClient({1, 2, 3});
  session_.OnClientEnd(now_);
  Pass(1s);
  EXPECT_EQ(over(), "");
  port_.unsent = 0;
  Pass(PortDrain::kLookEvery);
  EXPECT_EQ(over(), "it has left");
}

TEST_F(SessionTest, LeavesWhenWhatItHasSentBeforeItsTurnIsOut) {
  FromClient({1, 2});
  session_.OnClientEnd(now_);
  Pass(1s);
  EXPECT_EQ(over(), "");
  Begin();
  Pass(PortDrain::kLookEvery);
  EXPECT_EQ(port_.sent, Bytes({1, 2}));
  EXPECT_EQ(over(), "it has left");
}

TEST_F(SessionTest, LeavesAtLastWhereThePortTakesNothing) {
  Begin();
  port_.takes = false;
  FromClient({1, 2, 3});
  session_.OnClientEnd(now_);
  Pass(PortDrain::kLongest);
  EXPECT_THAT(over(), HasSubstr("the port did not take all"));
}

TEST_F(Rfc2217, NegotiatesWithoutThePort) {
  FromClient(*ParseHex("FF FB 2C FF FD 2C FF FD 18"));
  EXPECT_FALSE(session_.asks());
  EXPECT_EQ(ToHex(client_.sent), "FF FB 2C FF FC 18");
}

TEST_F(Rfc2217, AsksForThePortByACommandAndKeepsTheOrder) {
  FromClient(*ParseHex("61 FF FA 2C 02 07 FF F0 62"));
  EXPECT_TRUE(session_.asks());
  EXPECT_TRUE(client_.sent.empty());
  Begin();
  EXPECT_THAT(port_.sent, ElementsAre('a', 'b'));
  EXPECT_THAT(port_.calls, ElementsAre("apply 9600 7N1"));
  EXPECT_THAT(ToHex(client_.sent), HasSubstr("FF FA 2C 66 07 FF F0"));
}

TEST_F(Rfc2217, DoublesWhatWouldBeACommand) {
  Begin();
  FromPort({0x61, 0xFF, 0x62});
  EXPECT_EQ(ToHex(client_.sent), "61 FF FF 62");
  FromClient(*ParseHex("61 FF FF 62"));
  EXPECT_EQ(ToHex(port_.sent), "61 FF 62");
}

/// What was sent before the break has left, and what comes behind waits: a UART loses characters
/// during a break.
TEST_F(Rfc2217, IacBrkMakesABreakBetweenTheDataAroundIt) {
  Begin();
  port_.takes = false;
  FromClient(*ParseHex("61 FF F3 62"));
  EXPECT_EQ(ToHex(port_.sent), "61");
  EXPECT_TRUE(client_.paused);
  Pass(100ms);
  EXPECT_TRUE(port_.calls.empty()) << "the port still sends";
  port_.takes = true;
  port_.unsent = 0;
  Pass(Session::kLookBeforeBreak);
  EXPECT_THAT(port_.calls, ElementsAre("break on"));
  Pass(250ms);
  FromClient(*ParseHex("63"));
  EXPECT_EQ(ToHex(port_.sent), "61");
  Pass(50ms);
  EXPECT_THAT(port_.calls, ElementsAre("break on", "break off"));
  EXPECT_EQ(ToHex(port_.sent), "61 62 63");
  EXPECT_FALSE(client_.paused);
}

TEST_F(Rfc2217, IacBrkComesThroughADeviceThatTakesNothing) {
  Begin();
  port_.takes = false;
  FromClient(*ParseHex("61 FF F3"));
  Pass(Session::kMostBeforeBreak);
  EXPECT_THAT(port_.calls, ElementsAre("break on"));
}

TEST_F(Rfc2217, IacBrkAsksForThePort) {
  FromClient(*ParseHex("FF F3 FF F3"));
  EXPECT_TRUE(session_.asks());
  Begin();
  Pass(1s);
  EXPECT_THAT(port_.calls, ElementsAre("break on", "break off", "break on", "break off"));
}

TEST_F(Rfc2217, IacBrkDoesNotEndTheBreakOfACommand) {
  Begin();
  FromClient(*ParseHex("FF FA 2C 05 05 FF F0 FF F3"));
  Pass(1s);
  EXPECT_THAT(port_.calls, ElementsAre("break on", "break on", "break on"));
  FromClient(*ParseHex("FF FA 2C 05 06 FF F0"));
  EXPECT_EQ(port_.calls.back(), "break off");
}

TEST_F(Rfc2217, IacBrkOfAPortThatMakesNoneHoldsNothingUp) {
  port_.no_switches = true;
  Begin();
  FromClient(*ParseHex("61 FF F3 62"));
  EXPECT_EQ(ToHex(port_.sent), "61 62");
}

TEST_F(SessionTest, InRawModeNoByteIsABreak) {
  Begin();
  FromClient(*ParseHex("FF F3"));
  EXPECT_EQ(ToHex(port_.sent), "FF F3");
  EXPECT_TRUE(port_.calls.empty());
}

TEST_F(Rfc2217, SuspendsAndResumes) {
  Begin();
  FromClient(*ParseHex("FF FA 2C 08 FF F0"));
  EXPECT_TRUE(port_.paused);
  FromClient(*ParseHex("FF FA 2C 09 FF F0"));
  EXPECT_FALSE(port_.paused);
}

TEST_F(Rfc2217, TellsChangesOfControlLines) {
  port_.modem = ModemLines{};
  Begin();
  FromClient(*ParseHex("FF FA 2C 05 07 FF F0"));
  client_.sent.clear();
  Pass(Session::kLookEvery);
  EXPECT_TRUE(client_.sent.empty());
  port_.modem->cts = true;
  Pass(Session::kLookEvery);
  EXPECT_EQ(ToHex(client_.sent), "FF FA 2C 6B 11 FF F0");
  session_.End();
  Pass(Session::kLookEvery);
}

TEST_F(Rfc2217, AFloodOfCommandsWaitsForAClientThatReads) {
  Begin();
  client_.reads = false;
  Bytes flood;
  for (int i = 0; i < 500; ++i) Append(flood, View(*ParseHex("FF FA 2C 02 08 FF F0")));
  std::size_t floods = 0;
  while (!client_.paused && floods < 1000) {
    FromClient(flood);
    ++floods;
  }
  EXPECT_TRUE(client_.paused);
  EXPECT_LT(client_.held, 2 * Session::kMostForClient);
}

}  // namespace
}  // namespace baudgate::serial_server
