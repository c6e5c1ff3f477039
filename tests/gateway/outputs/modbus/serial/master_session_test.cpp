// Tests of `MasterSession`: the answers to a serial master, and when they are sent.
// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <string>

#include "gateway/base/text.h"
#include "gateway/outputs/modbus/serial/serial_listener.h"
#include "tests/gateway/outputs/modbus/serial/master_fixture.h"

namespace baudgate::modbus {
namespace {

TEST_F(MasterSessionTest, ReadsAreAnsweredFromTheStore) {
  Begin();
  AskForTheValue();
  AskForTheValue();
  EXPECT_EQ(Master().damaged, 0U);
}

TEST_F(MasterSessionTest, AWriteIsAnsweredWhenTheDeviceHasConfirmedIt) {
  Begin();
  Say(1, "06 00 00 00 07");
  ASSERT_EQ(commands(), 1U);
  ExpectSilence();
  sink_.commands[0].done({});
  Expect(1, "06 00 00 00 07");
}

TEST_F(MasterSessionTest, ExceptionsOfTheUnitAreSentToTheMaster) {
  Begin();
  Say(1, "03 10 00 00 01");
  Expect(1, "83 02");
  Say(1, "06 00 00 00 07");
  ASSERT_EQ(commands(), 1U);
  sink_.commands[0].done({WriteEnd::refused, "no"});
  Expect(1, "86 04");
}

TEST_F(MasterSessionTest, RoutedRequestsAreForwardedUnchanged) {
  Begin();
  Say(20, "03 00 C8 00 01");
  ASSERT_EQ(target_.requests.size(), 1U);
  EXPECT_EQ(target_.requests[0].slave, 20);
  EXPECT_EQ(ToHex(target_.requests[0].pdu), "03 00 C8 00 01");
  target_.Answer(0, "03 02 09 C4");
  Expect(20, "03 02 09 C4");
}

TEST_F(MasterSessionTest, AnUnansweredRequestEndsAtItsDeadline) {
  listener().errors = config::Listener::Errors::exception;
  config_.modbus.routes[0].deadline = 2500ms;
  Begin();
  Say(20, "03 00 C8 00 01");
  Pass(2500ms);
  EXPECT_THAT(sent_, testing::IsEmpty());
  Expect(20, "83 0B");
}

TEST_F(MasterSessionTest, ARequestMayComeInAnyPieces) {
  Begin();
  const Bytes request = Rtu(1, "03 00 00 00 01");
  for (std::size_t cut = 1; cut < request.size(); ++cut) {
    Hear(Bytes(request.begin(), request.begin() + static_cast<std::ptrdiff_t>(cut)));
    Hear(Bytes(request.begin() + static_cast<std::ptrdiff_t>(cut), request.end()));
    Expect(1, "03 02 FF FE");
  }
  for (const std::uint8_t byte : request) Hear({byte});
  Expect(1, "03 02 FF FE");
}

TEST_F(MasterSessionTest, HalfARequestIsCountedAsDamagedAfterTheGap) {
  Begin();
  Hear(ParseHex("01 03 00").value());
  Pass(19ms);
  EXPECT_EQ(Master().damaged, 0U) << "a USB adapter may hand over the rest 16 ms later";
  Pass(1ms);
  EXPECT_EQ(Master().damaged, 1U);
  AskForTheValue();
}

TEST_F(MasterSessionTest, AfterGarbageAndASilenceTheNextRequestIsAnswered) {
  Begin();
  Bytes bytes = ParseHex("FF 00 13 37 01 03 00").value();
  Append(bytes, View(Rtu(1, "06 00 00 00 07")));
  Hear(bytes);
  ExpectSilence();
  EXPECT_EQ(Master().damaged, 1U);
  EXPECT_EQ(commands(), 0U) << "it may be another's data";
  AskForTheValue();
  EXPECT_EQ(Master().damaged, 1U);
}

TEST_F(MasterSessionTest, DriverNoiseBeforeARequestIsIgnored) {
  Begin();
  Bytes bytes = ParseHex("FF 00").value();
  Append(bytes, View(Rtu(1, "03 00 00 00 01")));
  Hear(bytes);
  Expect(1, "03 02 FF FE");
  EXPECT_EQ(Master().damaged, 0U);
}

TEST_F(MasterSessionTest, DamageIsCountedAndNotAnswered) {
  Begin();
  Bytes request = Rtu(1, "03 00 00 00 01");
  request[3] ^= 0x01;
  Hear(request);
  ExpectSilence();
  EXPECT_EQ(Master().damaged, 1U);
  request = Rtu(1, "06 00 00 00 07");
  request.pop_back();
  Hear(request);
  ExpectSilence();
  EXPECT_EQ(Master().damaged, 2U);
  EXPECT_EQ(commands(), 0U);
  AskForTheValue();
}

TEST_F(MasterSessionTest, ExchangesOfOtherSlavesAreNotAnswered) {
  Begin();
  const std::pair<std::string, std::string> exchanges[] = {
      {"03 00 C8 00 01", "03 02 09 C4"},    {"03 00 C8 00 02", "03 04 09 C4 00 CA"},
      {"06 00 08 00 02", "06 00 08 00 02"}, {"10 00 01 00 01 02 00 05", "10 00 01 00 01"},
      {"03 10 00 00 01", "83 02"},
  };
  for (const auto& [request, reply] : exchanges) {
    Bytes bytes = Rtu(5, request);
    Append(bytes, View(Rtu(5, reply)));
    Append(bytes, View(Rtu(1, "03 00 00 00 01")));
    Hear(bytes);
    Expect(1, "03 02 FF FE");
  }
  EXPECT_EQ(Master().damaged, 0U);
  EXPECT_EQ(commands(), 0U);
}

TEST_F(MasterSessionTest, RequestsToUnmappedUnitsAreNotAnswered) {
  Begin();
  Say(77, "03 00 00 00 01");
  ExpectSilence();
  AskForTheValue();
}

TEST_F(MasterSessionTest, ABroadcastIsForwardedAndNotAnswered) {
  listener().broadcast = config::Listener::Broadcast::pass;
  Begin();
  Say(0, "06 00 08 00 00");
  ASSERT_EQ(target_.requests.size(), 1U);
  EXPECT_EQ(target_.requests[0].slave, 0);
  target_.Answer(0, "06 00 08 00 00");
  ExpectSilence();
  Say(0, "03 23 28 00 01");
  ExpectSilence();
  EXPECT_EQ(Client().bytes_out, 0U);
  AskForTheValue();
}

TEST_F(MasterSessionTest, ARepeatedRequestReplacesTheUnansweredRequest) {
  Begin();
  Say(20, "03 00 C8 00 01");
  Say(20, "03 00 C8 00 01");
  ASSERT_EQ(target_.requests.size(), 2U);
  target_.Answer(0, "03 02 AA AA");
  ExpectSilence();
  target_.Answer(1, "03 02 BB BB");
  Expect(20, "03 02 BB BB");
  AskForTheValue();
}

TEST_F(MasterSessionTest, ARequestToAnotherSlaveCancelsTheUnansweredRequest) {
  Begin();
  Say(20, "03 00 C8 00 01");
  Say(5, "03 00 C8 00 01");
  EXPECT_EQ(Master().frames, 2U);
  target_.Answer(0, "03 02 AA AA");
  ExpectSilence();
}

TEST_F(MasterSessionTest, AReplyWaitsForTrailingBytesOfARequest) {
  Begin();
  Bytes bytes = Rtu(1, "03 00 00 00 01");
  bytes.push_back(0x00);
  bytes.push_back(0x03);
  Hear(bytes);
  Pass(19ms);
  EXPECT_THAT(sent_, testing::IsEmpty());
  Expect(1, "03 02 FF FE");
  EXPECT_EQ(Master().damaged, 1U) << "it was sent into what might have become a request";
}

TEST_F(MasterSessionTest, AReplyWaitsForTheSilenceOfTheBus) {
  Begin();
  Say(1, "03 00 00 00 01");
  const Instant asked = now_.instant;
  Expect(1, "03 02 FF FE");
  EXPECT_EQ(sent_at_.at(0) - asked,
            protocols::ModbusRtuProtocol().timing(listener().serial).quiet.value());
  EXPECT_GE(sent_at_.at(0) - asked, LineTime(7) / 2) << "3.5 characters";
}

TEST_F(MasterSessionTest, TheMasterIsCountedAsAClient) {
  Begin();
  AskForTheValue();
  EXPECT_EQ(Client().peer, listener().path);
  EXPECT_EQ(Client().requests, 1U);
  EXPECT_EQ(Client().bytes_in, 8U);
  EXPECT_EQ(Client().bytes_out, 7U);
}

TEST_F(MasterSessionTest, RequestsToOtherSlavesAreNotCountedAsClientRequests) {
  Begin();
  for (int i = 0; i < 5; ++i) Say(5, "03 00 C8 00 01");
  AskForTheValue();
  EXPECT_EQ(Master().frames, 6U);
  EXPECT_EQ(Client().requests, 1U);
}

TEST_F(MasterSessionTest, AReplyAfterTheEndOfTheSessionIsDropped) {
  Begin();
  Say(20, "03 00 C8 00 01");
  session_.reset();
  EXPECT_EQ(target_.forgotten, 1);
  target_.Answer(0, "03 02 09 C4");
  Poll();
  EXPECT_THAT(sent_, testing::IsEmpty());
}

TEST_F(MasterSessionTest, AnAsciiMasterIsAnsweredAtEveryCut) {
  listener().framing = Framing::ascii;
  Begin();
  const Bytes request = Ascii(1, "03 00 00 00 01");
  for (std::size_t cut = 0; cut <= request.size(); ++cut) {
    Hear(Bytes(request.begin(), request.begin() + static_cast<std::ptrdiff_t>(cut)));
    Pass(900ms);
    Hear(Bytes(request.begin() + static_cast<std::ptrdiff_t>(cut), request.end()));
    Pass(100ms);
    EXPECT_THAT(std::exchange(sent_, {}), testing::ElementsAre(ToHex(Ascii(1, "03 02 FF FE"))))
        << cut;
  }
}

TEST_F(MasterSessionTest, AMasterOfAnotherFramingIsNamed) {
  for (const auto& [expected, spoken] :
       {std::pair(Framing::rtu, Framing::ascii), std::pair(Framing::ascii, Framing::rtu)}) {
    session_.reset();
    listener().framing = expected;
    Begin();
    const std::string pdu = "03 00 00 00 01";
    for (const std::uint8_t byte : spoken == Framing::ascii ? Ascii(1, pdu) : Rtu(1, pdu)) {
      Hear({byte});
    }
    ExpectSilence();
    Pass(2s);
    EXPECT_EQ(Master().other, spoken) << Title(spoken);
  }
}

constexpr const char* kWriteZero = "06 00 00 00 07";

class MasterEchoTest : public MasterSessionTest {
 protected:
  void BeginWith(config::Listener::Echo echo) {
    listener().echo = echo;
    Begin();
  }
  void WriteOnce() {
    const std::size_t number = commands();
    Say(1, kWriteZero);
    ASSERT_EQ(commands(), number + 1) << "it is carried out";
    sink_.commands[number].done({});
    Poll();
    Pass(session_->Deadline().value() - now_.instant);
    EXPECT_THAT(std::exchange(sent_, {}), testing::ElementsAre(ToHex(Rtu(1, kWriteZero))));
  }
  /// Delivers the bytes. The last byte arrives `after_the_reply` later than the latest reply was
  /// handed to the port.
  void HearAt(const Bytes& bytes, Duration after_the_reply) {
    Pass(sent_at_.back() + after_the_reply - now_.instant - LineTime(bytes.size()));
    Hear(bytes);
  }
  Duration Latest() { return LineTime(8) + 50ms; }
};

TEST_F(MasterEchoTest, OffAnEchoIsNotExecutedButCounted) {
  BeginWith(config::Listener::Echo::off);
  WriteOnce();
  Say(1, kWriteZero);
  ExpectSilence();
  EXPECT_EQ(commands(), 1U);
  EXPECT_EQ(Master().echoes, 1U);
  EXPECT_EQ(Master().frames, 1U) << "an echo is no frame of the bus";
  WriteOnce();
}

TEST_F(MasterEchoTest, OffAnEchoMayComeInPieces) {
  BeginWith(config::Listener::Echo::off);
  WriteOnce();
  for (const std::uint8_t byte : Rtu(1, kWriteZero)) Hear({byte});
  ExpectSilence();
  EXPECT_EQ(commands(), 1U);
  EXPECT_EQ(Master().echoes, 1U);
}

TEST_F(MasterEchoTest, OffAnEchoMayBe50MillisecondsAndItsLineTimeLate) {
  BeginWith(config::Listener::Echo::off);
  WriteOnce();
  HearAt(Rtu(1, kWriteZero), Latest());
  ExpectSilence();
  EXPECT_EQ(commands(), 1U);
  EXPECT_EQ(Master().echoes, 1U);
}

TEST_F(MasterEchoTest, OffALaterFrameIsARequest) {
  BeginWith(config::Listener::Echo::off);
  WriteOnce();
  HearAt(Rtu(1, kWriteZero), Latest() + 1ms);
  EXPECT_EQ(commands(), 2U);
  EXPECT_EQ(Master().echoes, 0U);
}

TEST_F(MasterEchoTest, OffTheMasterMayRepeatAWriteAfterTheEchoTime) {
  BeginWith(config::Listener::Echo::off);
  for (int i = 0; i < 3; ++i) {
    WriteOnce();
    Pass(Latest());
  }
  EXPECT_EQ(Master().echoes, 0U);
}

TEST_F(MasterEchoTest, OffAWriteRepeatedAtOnceIsExecutedTheSecondTime) {
  BeginWith(config::Listener::Echo::off);
  WriteOnce();
  Pass(LineTime(8) + 4ms);
  Say(1, kWriteZero);
  ExpectSilence();
  EXPECT_EQ(commands(), 1U);
  WriteOnce();
}

TEST_F(MasterEchoTest, OffTheEchoOfAnExceptionIsNotCountedAsFrameOrDamage) {
  BeginWith(config::Listener::Echo::off);
  Say(1, "03 10 00 00 01");
  Pass(session_->Deadline().value() - now_.instant);
  EXPECT_THAT(std::exchange(sent_, {}), testing::ElementsAre(ToHex(Rtu(1, "83 02"))));
  Say(1, "83 02");
  ExpectSilence();
  EXPECT_EQ(Master().frames, 1U);
  EXPECT_EQ(Master().damaged, 0U);
}

TEST_F(MasterEchoTest, OffOnlyTheFirstFrameBehindAReplyCanBeAnEcho) {
  BeginWith(config::Listener::Echo::off);
  WriteOnce();
  Say(20, "03 00 C8 00 01");
  Say(1, kWriteZero);
  EXPECT_EQ(commands(), 2U) << "the master writes between its other requests";
  EXPECT_EQ(Master().echoes, 0U);
}

TEST_F(MasterEchoTest, StripAnEchoIsRemovedAndTheNextWriteIsExecuted) {
  BeginWith(config::Listener::Echo::strip);
  for (int i = 0; i < 3; ++i) {
    WriteOnce();
    Say(1, kWriteZero);
    Pass(3ms);
  }
  EXPECT_EQ(commands(), 3U);
  EXPECT_EQ(Master().echoes, 0U) << "it is as it should be";
  EXPECT_EQ(Master().frames, 3U);
}

TEST_F(MasterEchoTest, StripAnEchoMayComeInPiecesAndLate) {
  BeginWith(config::Listener::Echo::strip);
  WriteOnce();
  Pass(Latest() + 1ms);
  for (const std::uint8_t byte : Rtu(1, kWriteZero)) Hear({byte});
  ExpectSilence();
  EXPECT_EQ(commands(), 1U);
  WriteOnce();
}

TEST_F(MasterEchoTest, StripARequestMayComeRightBehindAnEcho) {
  BeginWith(config::Listener::Echo::strip);
  AskForTheValue();
  Bytes bytes = Rtu(1, "03 02 FF FE");
  Append(bytes, View(Rtu(1, "03 00 00 00 01")));
  Hear(bytes);
  Expect(1, "03 02 FF FE");
  EXPECT_EQ(Master().frames, 2U);
}

TEST_F(MasterEchoTest, StripABusWithoutEchoWorks) {
  BeginWith(config::Listener::Echo::strip);
  for (int i = 0; i < 3; ++i) AskForTheValue();
  Say(20, "03 00 C8 00 01");
  EXPECT_EQ(target_.requests.size(), 1U);
}

class EveryMasterEchoTest : public MasterEchoTest,
                            public testing::WithParamInterface<config::Listener::Echo> {
 protected:
  bool Off() const { return GetParam() == config::Listener::Echo::off; }
};

TEST_P(EveryMasterEchoTest, ADamagedEchoIsCountedAndTheNextWriteIsExecuted) {
  BeginWith(GetParam());
  WriteOnce();
  Bytes echo = Rtu(1, kWriteZero);
  echo[5] ^= 0x10;
  Hear(echo);
  ExpectSilence();
  EXPECT_EQ(commands(), 1U);
  EXPECT_EQ(Master().echoes, 0U);
  EXPECT_EQ(Master().damaged, 1U);
  WriteOnce();
}

TEST_P(EveryMasterEchoTest, AnEchoBehindNoiseIsNotExecuted) {
  BeginWith(GetParam());
  WriteOnce();
  Bytes bytes = ParseHex("FF 00").value();
  Append(bytes, View(Rtu(1, kWriteZero)));
  Hear(bytes);
  ExpectSilence();
  EXPECT_EQ(commands(), 1U);
  EXPECT_EQ(Master().echoes, Off() ? 1U : 0U) << "with strip it is as it should be";
}

INSTANTIATE_TEST_SUITE_P(Echo, EveryMasterEchoTest,
                         testing::Values(config::Listener::Echo::off,
                                         config::Listener::Echo::strip),
                         [](const auto& info) {
                           return info.param == config::Listener::Echo::off ? "Off" : "Strip";
                         });

using enum config::Listener::Echo;

constexpr Instant kUntil{1s};
const std::string kReadFrame = "14 03 00 C8 00 01 07 31";
const std::string kValueFrame = "14 03 02 09 C4 B2 44";
const std::string kWriteFrame = "14 06 00 08 00 02 8B 0C";

Bytes Hex(const std::string& text) { return ParseHex(text).value(); }

std::string Filter(ReplyEcho& echo, const std::string& bytes) {
  return ToHex(echo.Filter(Hex(bytes)));
}

TEST(ReplyEcho, BeforeTheFirstReplyEverythingPasses) {
  for (const auto mode : {off, strip}) {
    ReplyEcho echo(mode);
    EXPECT_EQ(Filter(echo, kWriteFrame), kWriteFrame);
    EXPECT_FALSE(echo.IsEcho(Hex(kWriteFrame), kUntil));
  }
}

TEST(ReplyEcho, OffBytesPassAndEchoFramesAreRecognised) {
  struct Row {
    std::string reply, frame;
    Instant ended;
    bool echo;
  };
  for (const Row& row :
       {Row{kWriteFrame, kWriteFrame, kUntil, true}, Row{kValueFrame, kValueFrame, kUntil, true},
        Row{kWriteFrame, kWriteFrame, kUntil + 1ns, false},
        Row{kWriteFrame, kReadFrame, kUntil, false}}) {
    ReplyEcho echo(off);
    echo.OnSent(Hex(row.reply), kUntil);
    EXPECT_EQ(Filter(echo, row.frame), row.frame);
    EXPECT_FALSE(echo.holding());
    EXPECT_EQ(echo.IsEcho(Hex(row.frame), row.ended), row.echo) << row.frame;
    EXPECT_FALSE(echo.IsEcho(Hex(row.reply), kUntil)) << "only the first frame can be the echo";
  }
}

TEST(ReplyEcho, StripRemovesAnEchoInAnyPieces) {
  for (std::size_t cut = 1; cut < 7; ++cut) {
    ReplyEcho echo(strip);
    echo.OnSent(Hex(kValueFrame), kUntil);
    EXPECT_EQ(Filter(echo, kValueFrame.substr(0, 3 * cut)), "");
    EXPECT_TRUE(echo.holding());
    EXPECT_EQ(Filter(echo, kValueFrame.substr(3 * cut) + kReadFrame), kReadFrame);
    EXPECT_FALSE(echo.holding());
  }
}

TEST(ReplyEcho, StripReturnsBytesThatOnlyBeginLikeTheReply) {
  ReplyEcho echo(strip);
  echo.OnSent(Hex(kValueFrame), kUntil);
  EXPECT_EQ(Filter(echo, "14 03"), "");
  EXPECT_EQ(Filter(echo, "00 C8 00 01 07 31"), kReadFrame);
  echo.OnSent(Hex(kValueFrame), kUntil);
  EXPECT_EQ(Filter(echo, "14 03"), "");
  EXPECT_EQ(ToHex(echo.OnSilence()), "14 03");
}

TEST(ReplyEcho, StripRemovesOneEchoPerReply) {
  ReplyEcho echo(strip);
  echo.OnSent(Hex(kWriteFrame), kUntil);
  EXPECT_EQ(Filter(echo, kWriteFrame), "");
  EXPECT_EQ(Filter(echo, kWriteFrame), kWriteFrame);
  EXPECT_FALSE(echo.IsEcho(Hex(kWriteFrame), kUntil)) << "the master writes the same at once";
}

TEST(ReplyEcho, StripFindsAnEchoBehindNoise) {
  ReplyEcho echo(strip);
  echo.OnSent(Hex(kWriteFrame), kUntil);
  EXPECT_EQ(Filter(echo, "FF " + kWriteFrame), "FF " + kWriteFrame);
  EXPECT_TRUE(echo.IsEcho(Hex(kWriteFrame), kUntil));
}

}  // namespace
}  // namespace baudgate::modbus
