// What is echo of our own reply and what is the master's next request, by bytes and by time.
// SPDX-License-Identifier: Apache-2.0
#include "gateway/modbus/serial/reply_echo.h"

#include <gtest/gtest.h>

#include <string>

#include "gateway/base/text.h"

namespace baudgate::modbus {
namespace {

constexpr Instant kSent{1s};
constexpr Instant kEarliest = kSent + 7ms;

using Heard = ReplyEcho::Heard;

class ReplyEchoTest : public testing::Test {
 protected:
  void Reply(const std::string& request, const std::string& reply) {
    echo_.OnSent(ParseHex(request).value(), ParseHex(reply).value(), kEarliest);
  }
  std::string Hear(const std::string& bytes, Instant now) {
    return ToHex(echo_.Filter(ParseHex(bytes).value(), now));
  }
  /// What passes and is a whole frame.
  Heard HearFrame(const std::string& frame, Instant now) {
    EXPECT_EQ(Hear(frame, now), frame);
    return echo_.OnRequest(ParseHex(frame).value());
  }
  void LearnThatThereIsNone() {
    Reply(kRead, kValue);
    EXPECT_EQ(HearFrame(kRead, kEarliest), Heard::request);
  }
  void LearnThatThereIsOne() {
    Reply(kRead, kValue);
    EXPECT_EQ(Hear(kValue, kSent + 1ms), "");
  }
  /// What is thought of the same bytes as the reply to a write, long after it.
  Heard AfterAWrite() {
    Reply(kWrite, kWrite);
    return HearFrame(kWrite, kEarliest + 1s);
  }

  const std::string kRead = "14 03 00 C8 00 01 07 31";
  const std::string kValue = "14 03 02 09 C4 B2 44";
  const std::string kWrite = "14 06 00 08 00 02 8B 0C";
  const std::string kBusy = "14 86 06 32 A1";
  ReplyEcho echo_;
};

TEST_F(ReplyEchoTest, BeforeTheFirstReplyEverythingPasses) {
  EXPECT_EQ(HearFrame(kWrite, kSent), Heard::request);
  EXPECT_EQ(HearFrame(kWrite, kSent), Heard::request);
}

TEST_F(ReplyEchoTest, AnEchoIsTakenOutInAnyPieces) {
  for (int cut = 1; cut < 7; ++cut) {
    Reply(kRead, kValue);
    const std::size_t middle = static_cast<std::size_t>(cut) * 3;
    EXPECT_EQ(Hear(kValue.substr(0, middle), kSent + 1ms), "");
    EXPECT_TRUE(echo_.holding());
    EXPECT_EQ(Hear(kValue.substr(middle) + kRead, kSent + 1s), kRead);
    EXPECT_FALSE(echo_.holding());
  }
}

TEST_F(ReplyEchoTest, ARequestThatBeginsLikeTheReplyIsGivenBack) {
  Reply(kRead, kValue);
  EXPECT_EQ(Hear("14 03", kSent + 1ms), "");
  EXPECT_EQ(Hear("00 C8 00 01 07 31", kSent + 1ms), kRead);
  Reply(kRead, kValue);
  EXPECT_EQ(Hear("14 03", kSent + 1ms), "");
  EXPECT_EQ(ToHex(echo_.OnSilence()), "14 03");
}

TEST_F(ReplyEchoTest, WhileUnknownOnlyWhatIsTooEarlyForTheMasterIsSurelyAnEcho) {
  Reply(kWrite, kWrite);
  EXPECT_EQ(HearFrame(kWrite, kEarliest - 1us), Heard::echo);
  Reply(kWrite, kWrite);
  EXPECT_EQ(HearFrame(kWrite, kEarliest), Heard::doubt);
  EXPECT_EQ(AfterAWrite(), Heard::doubt) << "neither time nor the doubt itself teaches anything";
}

TEST_F(ReplyEchoTest, AnEchoThatBeganInTimeMayEndLater) {
  Reply(kWrite, kWrite);
  EXPECT_EQ(Hear("14 06", kEarliest - 1us), "14 06");
  EXPECT_EQ(Hear("00 08 00 02 8B 0C", kEarliest + 10ms), "00 08 00 02 8B 0C");
  EXPECT_EQ(echo_.OnRequest(ParseHex(kWrite).value()), Heard::echo);
}

TEST_F(ReplyEchoTest, OneReplyOwesOneEcho) {
  EXPECT_EQ(AfterAWrite(), Heard::doubt);
  EXPECT_EQ(HearFrame(kWrite, kEarliest + 2s), Heard::request);
  LearnThatThereIsOne();
  EXPECT_EQ(AfterAWrite(), Heard::echo);
  EXPECT_EQ(HearFrame(kWrite, kEarliest + 2s), Heard::request);
}

TEST_F(ReplyEchoTest, TheAnswerBusyEndsTheDoubt) {
  EXPECT_EQ(AfterAWrite(), Heard::doubt);
  Reply(kWrite, kBusy);
  EXPECT_EQ(Hear(kBusy, kEarliest + 1s), "");
  EXPECT_EQ(AfterAWrite(), Heard::echo);
  echo_.Reset();
  EXPECT_EQ(AfterAWrite(), Heard::doubt);
  Reply(kWrite, kBusy);
  EXPECT_EQ(HearFrame(kWrite, kEarliest + 1s), Heard::request);
  EXPECT_EQ(AfterAWrite(), Heard::request);
}

TEST_F(ReplyEchoTest, ADamagedEchoTeachesNothing) {
  Reply(kWrite, kBusy);
  EXPECT_EQ(Hear("14 86 07 32 A1", kEarliest), "14 86 07 32 A1");
  EXPECT_EQ(HearFrame(kWrite, kEarliest + 1s), Heard::request);
  EXPECT_EQ(AfterAWrite(), Heard::doubt);
  Reply(kRead, kValue);
  EXPECT_EQ(Hear("00 " + kValue, kSent + 1ms), "00 " + kValue);
  EXPECT_EQ(HearFrame(kRead, kEarliest + 1s), Heard::request);
  EXPECT_EQ(AfterAWrite(), Heard::doubt);
}

TEST_F(ReplyEchoTest, WhatWasOnItsWayBeforeTheReplyTeachesNothing) {
  Reply(kRead, kValue);
  EXPECT_EQ(HearFrame(kRead, kEarliest - 1us), Heard::request);
  EXPECT_EQ(AfterAWrite(), Heard::doubt);
}

TEST_F(ReplyEchoTest, AnEchoMayComeBehindOtherFrames) {
  LearnThatThereIsOne();
  Reply(kWrite, kWrite);
  EXPECT_EQ(HearFrame(kRead, kSent + 1ms), Heard::request);
  EXPECT_EQ(HearFrame(kWrite, kSent + 2ms), Heard::echo);
}

TEST_F(ReplyEchoTest, WithoutEchoesAMasterMayRepeatItsWriteAtOnce) {
  LearnThatThereIsNone();
  Reply(kWrite, kWrite);
  EXPECT_EQ(HearFrame(kWrite, kSent), Heard::request);
}

TEST_F(ReplyEchoTest, AnotherAdapterIsLearnedAnew) {
  LearnThatThereIsNone();
  EXPECT_EQ(AfterAWrite(), Heard::request);
  LearnThatThereIsOne();
  EXPECT_EQ(AfterAWrite(), Heard::echo);
  echo_.Reset();
  EXPECT_EQ(AfterAWrite(), Heard::doubt);
}

}  // namespace
}  // namespace baudgate::modbus
