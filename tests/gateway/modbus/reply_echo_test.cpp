// What is echo of our own reply and what is the master's next request, by bytes and by time.
// SPDX-License-Identifier: Apache-2.0
#include "gateway/modbus/reply_echo.h"

#include <gtest/gtest.h>

#include <string>

#include "gateway/base/text.h"

namespace baudgate::modbus {
namespace {

constexpr Instant kSent{1s};
constexpr Instant kEarliest = kSent + 7ms;

class ReplyEchoTest : public testing::Test {
 protected:
  void Reply(const std::string& request, const std::string& reply) {
    echo_.OnSent(ParseHex(request).value(), ParseHex(reply).value(), kEarliest);
  }
  std::string Hear(const std::string& bytes, Instant now) {
    return ToHex(echo_.Filter(ParseHex(bytes).value(), now));
  }
  void LearnThatThereIsNone() {
    Reply(kRead, kValue);
    EXPECT_EQ(Hear(kRead, kEarliest + 1s), kRead);
    echo_.OnRequest(8);
  }
  void LearnThatThereIsOne() {
    Reply(kRead, kValue);
    EXPECT_EQ(Hear(kValue, kSent + 1ms), "");
  }

  const std::string kRead = "14 03 00 C8 00 01 07 31";
  const std::string kValue = "14 03 02 09 C4 B2 44";
  const std::string kWrite = "14 06 00 08 00 02 8B 0C";
  ReplyEcho echo_;
};

TEST_F(ReplyEchoTest, BeforeTheFirstReplyEverythingPasses) {
  EXPECT_EQ(Hear(kWrite, kSent), kWrite);
  EXPECT_EQ(Hear(kWrite, kSent), kWrite);
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

TEST_F(ReplyEchoTest, WhileUnknownTheTimeDecidesAboutWrites) {
  Reply(kWrite, kWrite);
  EXPECT_EQ(Hear(kWrite, kEarliest - 1us), "");
  Reply(kWrite, kWrite);
  EXPECT_EQ(Hear(kWrite, kEarliest), kWrite);
}

TEST_F(ReplyEchoTest, AnEchoThatBeganInTimeMayEndLater) {
  Reply(kWrite, kWrite);
  EXPECT_EQ(Hear("14 06", kEarliest - 1us), "");
  EXPECT_EQ(Hear("00 08 00 02 8B 0C", kEarliest + 10ms), "");
}

TEST_F(ReplyEchoTest, AnAdapterThatEchoesMayBeLate) {
  LearnThatThereIsOne();
  Reply(kWrite, kWrite);
  EXPECT_EQ(Hear(kWrite, kEarliest + 1s), "");
  EXPECT_EQ(Hear(kWrite, kEarliest + 1s), kWrite) << "once only";
}

TEST_F(ReplyEchoTest, WithoutEchoesAMasterMayRepeatItsWriteAtOnce) {
  LearnThatThereIsNone();
  Reply(kWrite, kWrite);
  EXPECT_EQ(Hear(kWrite, kSent), kWrite);
}

TEST_F(ReplyEchoTest, NoiseBeforeAnEchoTeachesNothing) {
  Reply(kRead, kValue);
  EXPECT_EQ(Hear("00 " + kValue, kSent + 1ms), "00 " + kValue);
  EXPECT_EQ(Hear(kRead, kEarliest + 1s), kRead);
  echo_.OnRequest(8);
  Reply(kWrite, kWrite);
  EXPECT_EQ(Hear(kWrite, kSent), "");
}

TEST_F(ReplyEchoTest, AnotherAdapterIsLearnedAnew) {
  LearnThatThereIsNone();
  LearnThatThereIsOne();
  Reply(kWrite, kWrite);
  EXPECT_EQ(Hear(kWrite, kEarliest + 1s), "");
  echo_.Reset();
  Reply(kWrite, kWrite);
  EXPECT_EQ(Hear(kWrite, kEarliest + 1s), kWrite);
}

}  // namespace
}  // namespace baudgate::modbus
