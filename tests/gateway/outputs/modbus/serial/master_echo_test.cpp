// A two-wire adapter that gives the gateway its own replies back: an echo is never carried out.
// SPDX-License-Identifier: Apache-2.0
#include "tests/gateway/outputs/modbus/serial/master_fixture.h"

namespace baudgate::modbus {
namespace {

constexpr const char* kWriteZero = "06 00 00 00 07";

class MasterEchoTest : public MasterSessionTest {
 protected:
  void BeginWith(config::Listener::Echo echo) {
    listener().echo = echo;
    Begin();
  }
  /// The master sends a write that is confirmed; ends as the reply is handed to the port.
  void WriteOnce() {
    const std::size_t number = commands();
    Say(1, kWriteZero);
    ASSERT_EQ(commands(), number + 1) << "it is carried out";
    sink_.commands[number].done({});
    Poll();
    Pass(session_->Deadline().value() - now_.instant);
    EXPECT_THAT(std::exchange(sent_, {}), testing::ElementsAre(ToHex(Rtu(1, kWriteZero))));
  }
  /// The same bytes, the last of them so long after the reply was handed to the port.
  void HearAt(const Bytes& bytes, Duration after_the_reply) {
    Pass(sent_at_.back() + after_the_reply - now_.instant - LineTime(bytes.size()));
    Hear(bytes);
  }
  Duration Latest() { return LineTime(8) + 50ms; }
};

TEST_F(MasterEchoTest, OffAnEchoIsNotCarriedOutAndCounted) {
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

TEST_F(MasterEchoTest, OffWhatComesLaterIsTheMasters) {
  BeginWith(config::Listener::Echo::off);
  WriteOnce();
  HearAt(Rtu(1, kWriteZero), Latest() + 1ms);
  EXPECT_EQ(commands(), 2U);
  EXPECT_EQ(Master().echoes, 0U);
}

TEST_F(MasterEchoTest, OffAMasterMayWriteTheSameAgainAndAgain) {
  BeginWith(config::Listener::Echo::off);
  for (int i = 0; i < 3; ++i) {
    WriteOnce();
    Pass(Latest());
  }
  EXPECT_EQ(Master().echoes, 0U);
}

TEST_F(MasterEchoTest, OffAMasterThatRepeatsAtOnceIsHeardTheSecondTime) {
  BeginWith(config::Listener::Echo::off);
  WriteOnce();
  Pass(LineTime(8) + 4ms);
  Say(1, kWriteZero);
  ExpectSilence();
  EXPECT_EQ(commands(), 1U);
  WriteOnce();
}

TEST_F(MasterEchoTest, OffTheEchoOfAnExceptionIsNeitherRequestNorDamage) {
  BeginWith(config::Listener::Echo::off);
  Say(1, "03 10 00 00 01");
  Pass(session_->Deadline().value() - now_.instant);
  EXPECT_THAT(std::exchange(sent_, {}), testing::ElementsAre(ToHex(Rtu(1, "83 02"))));
  Say(1, "83 02");
  ExpectSilence();
  EXPECT_EQ(Master().frames, 1U);
  EXPECT_EQ(Master().damaged, 0U);
}

TEST_F(MasterEchoTest, OffOnlyTheFirstFrameBehindAReplyIsItsEcho) {
  BeginWith(config::Listener::Echo::off);
  WriteOnce();
  Say(20, "03 00 C8 00 01");
  Say(1, kWriteZero);
  EXPECT_EQ(commands(), 2U) << "the master writes between its other requests";
  EXPECT_EQ(Master().echoes, 0U);
}

TEST_F(MasterEchoTest, StripAnEchoIsTakenOutAndTheNextWriteIsTheMasters) {
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

/// What `off` and `strip` have in common.
class EveryMasterEchoTest : public MasterEchoTest,
                            public testing::WithParamInterface<config::Listener::Echo> {
 protected:
  bool Off() const { return GetParam() == config::Listener::Echo::off; }
};

TEST_P(EveryMasterEchoTest, ADamagedEchoIsDamageAndTheNextWriteIsTheMasters) {
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

TEST_P(EveryMasterEchoTest, AnEchoBehindNoiseIsFound) {
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

}  // namespace
}  // namespace baudgate::modbus
