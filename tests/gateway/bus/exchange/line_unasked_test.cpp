// A line on which a device speaks unasked, with and without exchanges.
// SPDX-License-Identifier: Apache-2.0
#include <algorithm>

#include "tests/gateway/bus/exchange/line_fixture.h"

namespace baudgate {
namespace {

/// "<abc>"
Cut Message(View held, const Expectation&, bool) {
  if (held[0] != '<') return Cut::Discard(1, Outcome::none, "no message");
  const auto end = std::find(held.begin(), held.end(), '>');
  if (end == held.end()) return Cut::NeedMore();
  return Cut::Frame(static_cast<std::size_t>(end - held.begin()) + 1);
}

class LineUnaskedTest : public ::testing::Test, protected LineClient {
 protected:
  LineUnaskedTest() {
    line_.Listen(standing_);
    line_.OnOpened(At(0ms));
  }

  static Instant At(Duration offset) { return kStart + offset; }
  void Keep(const LineNews& news) {
    for (const auto& message : news.unasked.messages) said_.emplace_back(AsText(message.bytes));
    damaged_ += news.unasked.damaged;
    strays_ += news.stray.count + news.stray_before.count;
    if (news.end) ends_.push_back(news.end->outcome);
    if (news.send) ++sent_;
  }
  void Bytes_(std::string_view bytes, Duration at) { Keep(line_.Feed(ToBytes(bytes), At(at))); }
  void Timer(Duration at) { Keep(line_.OnTimer(At(at))); }
  void Start(Duration at, Expectation::Reply reply = Expectation::Reply::one) {
    Exchange exchange;
    exchange.request.bytes = ToBytes("?A1\r");
    exchange.request.expect = ToyProtocol().expect(exchange.request.bytes, {});
    exchange.request.expect.reply = reply;
    exchange.reply_rule = ToyProtocol().reply_rule;
    exchange.times = kTimes;
    Keep(line_.Start(std::move(exchange), At(at)));
    Timer(at + 4ms);
  }
  Outcome Judge(View frame, Instant) override {
    frames_.emplace_back(AsText(frame));
    return Outcome::ok;
  }

  const Standing standing_{.rule = Message,
                           .expect = {.reply = Expectation::Reply::standing, .max_bytes = 32},
                           .idle = 20ms,
                           .whole = 100ms,
                           .marked = true};
  Line line_{*this};
  const std::string reply_{AsText(ToyReply("A1=5"))};
  std::vector<std::string> said_;
  std::vector<std::string> frames_;
  std::vector<Outcome> ends_;
  std::size_t damaged_ = 0;
  std::size_t strays_ = 0;
  int sent_ = 0;
};

using Said = std::vector<std::string>;

TEST_F(LineUnaskedTest, HearsInIdleAndIsReceivingMeanwhile) {
  EXPECT_EQ(line_.Deadline(), std::nullopt) << "silence is no failure";
  Bytes_("<a", 1s);
  EXPECT_FALSE(line_.idle());
  EXPECT_EQ(line_.state(), Line::State::receiving);
  EXPECT_EQ(line_.Deadline(), At(1020ms));
  Bytes_("b>", 1010ms);
  EXPECT_EQ(said_, Said{"<ab>"});
  EXPECT_TRUE(line_.idle());
  EXPECT_EQ(strays_, 0U);
}

TEST_F(LineUnaskedTest, WhatComesInIdleIsTheSpeakersAndNoStray) {
  Start(1s);
  Bytes_(reply_, 1030ms);
  ASSERT_EQ(frames_.size(), 1U);
  Bytes_(reply_, 2s);
  EXPECT_EQ(strays_, 0U) << "nor is it told as a late reply";
}

TEST_F(LineUnaskedTest, AReplyDoesNotGoOnAfterTheProgramWasStopped) {
  Start(1s);
  Bytes_(reply_.substr(0, 3), 1020ms);
  Bytes_(reply_.substr(3), 1150ms);  // before the ceiling
  EXPECT_THAT(frames_, ::testing::IsEmpty());
  EXPECT_EQ(ends_, std::vector{Outcome::partial});
}

TEST_F(LineUnaskedTest, AMessageThatStopsIsDamagedAndTheLineIsFreeAgain) {
  Bytes_("<a", 1s);
  Timer(1020ms);
  EXPECT_TRUE(line_.idle());
  EXPECT_EQ(damaged_, 1U);
}

/// Every place of the message in the bytes of the reply: neither is taken for the other.
TEST_F(LineUnaskedTest, AMessageInsideAReplyIsTakenOutOfIt) {
  Duration at = 1s;
  for (std::size_t place = 0; place <= reply_.size(); ++place) {
    said_.clear();
    frames_.clear();
    ends_.clear();
    Start(at);
    std::string stream = reply_;
    stream.insert(place, "<tag>");
    for (const char c : stream) Bytes_(std::string(1, c), at += 6ms);
    if (ends_.empty()) Timer(at += 20ms);
    EXPECT_EQ(said_, Said{"<tag>"}) << place;
    EXPECT_EQ(frames_, Said{reply_}) << place;
    EXPECT_EQ(ends_, std::vector{Outcome::ok}) << place;
    at += 1s;
    Timer(at);
    ASSERT_TRUE(line_.idle());
  }
}

TEST_F(LineUnaskedTest, AMessageIsNoReplyAndTheReplyTimeGoesOn) {
  Start(1s);
  Bytes_("<tag>", 1050ms);
  EXPECT_TRUE(ends_.empty());
  EXPECT_EQ(line_.Deadline(), At(1104ms));
  Timer(1104ms);
  EXPECT_EQ(ends_, std::vector{Outcome::no_reply});
  EXPECT_EQ(said_, Said{"<tag>"});
}

TEST_F(LineUnaskedTest, AMessageAnswersARequestThatAsksForOne) {
  Start(1s, Expectation::Reply::standing);
  Bytes_("<a><b>", 1050ms);
  EXPECT_EQ(ends_, std::vector{Outcome::ok});
  EXPECT_EQ(frames_, Said{"<a>"});
  EXPECT_EQ(said_, (Said{"<a>", "<b>"})) << "it is a message all the same";
  EXPECT_TRUE(line_.idle());
}

TEST_F(LineUnaskedTest, MessagesInDrainAndBeforeARequestAreHeard) {
  Start(1s);
  Timer(1104ms);
  ASSERT_EQ(line_.state(), Line::State::drain);
  Bytes_("<a>", 1110ms);
  EXPECT_EQ(said_, Said{"<a>"});
  EXPECT_EQ(strays_, 0U);
  Timer(2s);
  Bytes_("<b>", 2s);
  Exchange exchange;
  exchange.request.bytes = ToBytes("?A1\r");
  exchange.times = kTimes;
  exchange.reply_rule = ToyProtocol().reply_rule;
  Keep(line_.Start(exchange, At(2001ms)));
  EXPECT_EQ(line_.state(), Line::State::quiet);
  Bytes_("<c>", 2004ms);
  EXPECT_EQ(line_.Deadline(), At(2009ms)) << "quiet counts anew";
  EXPECT_EQ(said_, (Said{"<a>", "<b>", "<c>"}));
}

/// Babble: a request goes out all the same, after the ceiling at the latest.
TEST_F(LineUnaskedTest, BabbleKeepsNobodyFromAskingForEver) {
  Duration at = 1s;
  Bytes_("<", at);
  while (!line_.idle() && at < 2s) {
    Bytes_("x", at += 3ms);
    Timer(at);
  }
  ASSERT_LT(at, 1200ms) << "a message that takes too long is over";
  Exchange exchange;
  exchange.request.bytes = ToBytes("?A1\r");
  exchange.times = kTimes;
  exchange.reply_rule = ToyProtocol().reply_rule;
  Keep(line_.Start(exchange, At(at)));
  const Duration from = at;
  while (sent_ == 0 && at < 3s) {
    Bytes_("x", at += 3ms);
    Timer(at);
  }
  EXPECT_LE(at - from, kTimes.ceiling + 3ms);
}

TEST_F(LineUnaskedTest, ALostPortLosesWhatHasBegun) {
  Bytes_("<a", 1s);
  Keep(line_.OnClosed());
  EXPECT_EQ(line_.Deadline(), std::nullopt);
  line_.OnOpened(At(2s));
  EXPECT_TRUE(line_.idle());
  Bytes_("b><c>", 2s);
  EXPECT_EQ(said_, Said{"<c>"});
}

}  // namespace
}  // namespace baudgate
