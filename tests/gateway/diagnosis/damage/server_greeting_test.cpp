// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>
#include <string_view>
#include <vector>

#include "gateway/base/text.h"
#include "gateway/diagnosis/damage/changed_bytes.h"
#include "gateway/diagnosis/damage/reply_habits.h"
#include "gateway/diagnosis/observer.h"
#include "tests/gateway/bus/poller/part_fixture.h"
#include "tests/support/times.h"

namespace baudgate::diagnosis {
namespace {

class ServerGreetingTest : public ::testing::Test {
 protected:
  const Bytes login_ = ToBytes("Login: ");
  const Bytes reply_ = ToBytes("A1=5\r");
  ServerGreeting greeting_;
};

TEST_F(ServerGreetingTest, ATextBeforeOrWithTheFirstRequestIsAGreeting) {
  greeting_.Keep(login_);
  greeting_.NoteExchange({}, false);
  EXPECT_EQ(greeting_.text(), login_);
  greeting_.OnOpened();
  EXPECT_TRUE(greeting_.text().empty());
  greeting_.NoteExchange(login_, true);
  EXPECT_EQ(greeting_.text(), login_);
}

TEST_F(ServerGreetingTest, ATextInALaterExchangeIsNoGreeting) {
  greeting_.NoteExchange({}, false);
  greeting_.NoteExchange(login_, true);
  EXPECT_TRUE(greeting_.text().empty());
}

TEST_F(ServerGreetingTest, TheGreetingIsClearedOnceADeviceHasAnswered) {
  greeting_.Keep(login_);
  EXPECT_EQ(greeting_.OnAnswered(reply_), login_);
  greeting_.NoteExchange(reply_, false);
  EXPECT_TRUE(greeting_.text().empty());
}

TEST_F(ServerGreetingTest, AGreetingAtTheFirstRequestIsReturnedWithItsReply) {
  EXPECT_EQ(greeting_.OnAnswered(reply_), reply_);
  greeting_.NoteExchange(reply_, false);
  EXPECT_TRUE(greeting_.OnAnswered(reply_).empty());
}

TEST(ChangedBytes, OneOrTwoBytesLostInsideAReplyAreDetected) {
  const struct {
    std::string heard;
    std::string reply;
    bool lacks;
  } rows[] = {
      {">+0.34\r", ">+02.34\r", true},
      {">+0.4\r", ">+02.34\r", true},
      {">+0.4\r\n", ">+02.34\r", true},
      {">+02.34\r", ">+02.34\r", false},
      {">+.4\r", ">+02.34\r", false},  // three lost bytes are too many
      {">+0.35\r", ">+02.34\r", true},
      {">+9.51\r", ">+02.34\r", false},
      {":0103043666F0\r\n", ":010304436643660866F0\r\n", true},  // several bytes are lost in a row
      {":0103043666F0", ":010304436643660866F0\r\n", false},
      {"<+0.34\r", ">+02.34\r", false},
      {">+4\r", ">+04\r", false},  // too short for a proof
      {"", ">+02.34\r", false},
  };
  for (const auto& row : rows) {
    EXPECT_EQ(LacksSome(ToBytes(row.heard), ToBytes(row.reply)), row.lacks) << row.heard;
  }
}

class HeardExchangeTest : public ::testing::Test, protected bus::ToyMembers {
 protected:
  HeardExchangeTest() { exchange_.Begin(a, bus::AskFor("?A1\r"), a.times, kStart); }

  std::string Before() { return ToText(exchange_.BesideReply().first); }
  std::string Behind() { return ToText(exchange_.BesideReply().second); }
  static std::string ToText(View bytes) { return {bytes.begin(), bytes.end()}; }

  HeardExchange exchange_;
};

TEST_F(HeardExchangeTest, BytesBeforeAndAfterTheReplyAreReturned) {
  exchange_.Hear(ToBytes("xA1=5\r\ny"), kStart + 50ms);
  EXPECT_EQ(Before(), "xA1=5\r\ny");
  exchange_.Take(ToBytes("A1=5"));
  EXPECT_EQ(Before(), "x");
  EXPECT_EQ(Behind(), "y");
}

TEST_F(HeardExchangeTest, BytesAfterTheEndAreReportedOnce) {
  exchange_.Hear(ToBytes("A1"), kStart + 50ms);
  EXPECT_FALSE(exchange_.TakeMore());
  exchange_.End(Outcome::partial);
  EXPECT_FALSE(exchange_.TakeMore());
  exchange_.Hear(ToBytes("=5"), kStart + 90ms);
  EXPECT_TRUE(exchange_.TakeMore());
  EXPECT_FALSE(exchange_.TakeMore());
}

TEST_F(HeardExchangeTest, TheIdleTimeCountsFromTheLatestByteInOrOut) {
  EXPECT_EQ(exchange_.idle(), kLongIdle);
  exchange_.Hear(ToBytes("A1=5\r"), kStart + 50ms);
  exchange_.Begin(a, bus::AskFor("?A2\r"), a.times, kStart + 80ms);
  EXPECT_EQ(exchange_.idle(), 30ms);
  EXPECT_TRUE(exchange_.heard().empty());
}

TEST_F(HeardExchangeTest, KeepsNoMoreThanALongReply) {
  for (int i = 0; i < 1000; ++i) exchange_.Hear(ToBytes("0123456789"), kStart + i * 1ms);
  EXPECT_EQ(exchange_.heard().size(), 1024U);
  EXPECT_LE(exchange_.arrivals().size(), 256U);
}

/// Returns the bytes that a UART with a wrong bit rate receives. `per_bit` is the number of its
/// bits in one bit of `text`, which is sent as 8N1 without pauses. If a stop bit is 0, the UART
/// delivers FF and takes this bit for the next start bit.
Bytes Received(std::string_view text, double per_bit) {
  std::vector<bool> wire;
  for (const char character : text) {
    wire.push_back(false);
    for (unsigned bit = 0; bit < 8; ++bit) {
      wire.push_back((static_cast<unsigned char>(character) >> bit & 1U) != 0);
    }
    wire.push_back(true);
  }
  const auto sample = [&](double at) {
    const auto bit = static_cast<std::size_t>(at / per_bit);
    return bit >= wire.size() || wire[bit];
  };
  Bytes read;
  const double end = static_cast<double>(wire.size()) * per_bit;
  for (double at = 0; at < end;) {
    if (sample(at)) {
      at += 0.25;
      continue;
    }
    unsigned byte = 0;
    for (unsigned bit = 0; bit < 8; ++bit) {
      if (sample(at + 1.5 + bit)) byte |= 1U << bit;
    }
    const bool stops = sample(at + 9.5);
    read.push_back(static_cast<std::uint8_t>(stops ? byte : 0xFF));
    at += stops ? 9.5 : 9;
  }
  return read;
}

TEST(OtherBitRate, HalfAndTwiceTheBitRateAreDetected) {
  for (const char* text : {">+02.500+03.100+00.000+00.001\r", "<1D:0.52/0.50/0.51:7F\r\n",
                           ":010304006400C8CB\r\n", "$GPGGA,123519,4807.038,N\r\n"}) {
    const auto slow = OtherBitRate(Received(text, 2), false);
    ASSERT_TRUE(slow) << text;
    EXPECT_EQ(slow->cause, "its characters come at half the configured bit rate");
    const auto fast = OtherBitRate(Received(text, 0.5), true);
    ASSERT_TRUE(fast) << text;
    EXPECT_EQ(fast->cause, "its characters come at twice the configured bit rate");
    EXPECT_THAT(fast->remedy, ::testing::HasSubstr("serial server"));
    EXPECT_FALSE(OtherBitRate(ToBytes(text), false)) << text;
  }
}

TEST(OtherBitRate, NoiseAndConstantBytesAreNotDetected) {
  EXPECT_FALSE(OtherBitRate({}, false));
  EXPECT_FALSE(OtherBitRate(Bytes(30, 0x00), false)) << "a line that nobody drives";
  EXPECT_FALSE(OtherBitRate(Bytes(30, 0xFF), false));
  EXPECT_FALSE(OtherBitRate(Bytes(30, 0x78), false)) << "one value";
  std::minstd_rand random(1);
  int taken = 0;
  for (int i = 0; i < 1000; ++i) {
    Bytes noise(20);
    for (std::uint8_t& byte : noise) byte = static_cast<std::uint8_t>(random() >> 7U);
    if (OtherBitRate(noise, false)) ++taken;
  }
  EXPECT_EQ(taken, 0);
}

class ReplyHabitsTest : public ::testing::Test, protected bus::ToyMembers {
 protected:
  /// Runs an exchange with the replies `came`. `own` is the accepted reply; empty: no
  /// reply is accepted.
  void Exchange(std::string_view asked, const std::vector<Bytes>& came, const Bytes& own = {}) {
    exchange_.Begin(a, bus::AskFor(asked), a.times, kStart);
    habits_.OnBegin(a);
    for (const Bytes& bytes : came) exchange_.Hear(bytes, kStart + 50ms);
    if (!own.empty()) exchange_.Take(own);
    exchange_.End(own.empty() ? Outcome::corrupt : Outcome::ok);
    if (!own.empty()) habits_.OnAnswered(exchange_);
  }

  const Bytes one_ = ToyReply("A1=5");
  const Bytes two_ = ToyReply("A2=6");
  HeardExchange exchange_;
  ReplyHabits habits_;
};

TEST_F(ReplyHabitsTest, ASecondReplyAfterALostTryIsLateUnlessTheDeviceSendsTwo) {
  habits_.OnBegin(a);
  habits_.OnLost(a, kStart);
  habits_.OnBegin(a);
  const auto lost = habits_.TakeLostTry(a, kStart + 2s);
  ASSERT_TRUE(lost);
  EXPECT_EQ(lost->after, 2s);
  EXPECT_EQ(lost->back, 2U);
  EXPECT_FALSE(habits_.TakeLostTry(a, kStart + 2s)) << "it was taken";
  habits_.OnLost(a, kStart + 3s);
  EXPECT_FALSE(habits_.TakeLostTry(a, kStart + 4s)) << "it is known to send two";
}

TEST_F(ReplyHabitsTest, ALostTryIsForgottenAfterFiveSeconds) {
  habits_.OnLost(a, kStart);
  EXPECT_FALSE(habits_.TakeLostTry(a, kStart + 5s));
}

TEST_F(ReplyHabitsTest, AReplyAcceptedForAnotherRequestIsACopy) {
  Exchange("?A1\r", {one_}, one_);
  Exchange("?A2\r", {one_, two_}, two_);
  EXPECT_TRUE(habits_.IsCopy(exchange_));
  Exchange("?A2\r", {ToyReply("A1=8"), two_}, two_);
  EXPECT_FALSE(habits_.IsCopy(exchange_)) << "it was not taken before";
}

TEST_F(ReplyHabitsTest, ATextThatRepeatedlyLacksACharacterIsOfAnotherForm) {
  const Finding lacks{.symptom = Symptom::bytes_lost, .cause = "a character"};
  Exchange("?A1\r", {ToBytes("!A1=*C1\r")});
  EXPECT_EQ(habits_.Compare(exchange_, lacks).symptom, Symptom::bytes_lost);
  EXPECT_EQ(habits_.Compare(exchange_, lacks).symptom, Symptom::other_form);
  Exchange("?A1\r", {one_}, one_);
  Exchange("?A1\r", {ToBytes("!A1=*C1\r")});
  EXPECT_EQ(habits_.Compare(exchange_, lacks).symptom, Symptom::bytes_lost) << "it was good since";
}

}  // namespace
}  // namespace baudgate::diagnosis
