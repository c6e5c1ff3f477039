// Tests of `UnaskedReceiver`: messages that a device sends without a request.
// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <string>

#include "gateway/base/text.h"
#include "gateway/bus/exchange/line.h"
#include "tests/gateway/bus/exchange/line_fixture.h"
#include "tests/support/times.h"

namespace baudgate::bus {
namespace {

constexpr Instant kOpened = Instant() + 1h;

protocols::Cut Bracketed(View held, const protocols::Expectation& expect, bool) {
  if (held[0] != '<') return protocols::Cut::Discard(1, Outcome::partial, "noise");
  const auto end = std::find(held.begin(), held.end(), '>');
  if (end == held.end()) return protocols::Cut::NeedMore();
  const auto size = static_cast<std::size_t>(end - held.begin()) + 1;
  if (size > expect.max_bytes) return protocols::Cut::Discard(1, Outcome::corrupt, "too long");
  return protocols::Cut::Frame(size);
}

/// Cuts messages of the form "abc\r".
protocols::Cut Ended(View held, const protocols::Expectation&, bool) {
  const auto end = std::find(held.begin(), held.end(), '\r');
  if (end == held.end()) return protocols::Cut::NeedMore();
  return protocols::Cut::Frame(static_cast<std::size_t>(end - held.begin()) + 1);
}

/// Cuts messages of the form "abc". Only silence ends a message.
protocols::Cut Silent(View held, const protocols::Expectation&, bool idle) {
  return idle ? protocols::Cut::Frame(held.size()) : protocols::Cut::NeedMore();
}

struct Piece {
  Duration at;
  std::string bytes;
};

struct Case {
  std::string name;
  protocols::FrameRule rule;
  std::vector<Piece> pieces;
  std::string messages;  ///< each message with the time of its last byte in ms: "<a>@1000"
  std::size_t damaged = 0;
  std::string rest{};
};

class UnaskedReceiverTest : public ::testing::TestWithParam<Case> {
 protected:
  static protocols::Standing StandingOf(protocols::FrameRule rule) {
    return {.rule = rule,
            .expect = {.reply = protocols::Expectation::Reply::standing, .max_bytes = 16},
            .idle = 50ms,
            .whole = 200ms,
            .marked = rule == Bracketed};
  }

  void Note(const UnaskedInput& heard, Instant now) {
    for (const UnaskedMessage& message : heard.messages) {
      const auto at = (now - message.since - kOpened) / 1ms;
      messages_ += Printable(message.bytes) + "@" + std::to_string(at) + " ";
    }
    damaged_ += heard.damaged;
    EXPECT_EQ(heard.why.empty(), heard.damaged == 0);
    Append(rest_, heard.rest);
  }
  void Play(const std::vector<Piece>& pieces, protocols::FrameRule rule) {
    const protocols::Standing standing = StandingOf(rule);
    UnaskedReceiver ear(standing);
    ear.Begin(kOpened);
    const auto run_to = [&](Instant until) {
      while (ear.Deadline() && *ear.Deadline() <= until) {
        const Instant at = *ear.Deadline();
        Note(ear.OnTimer(at), at);
      }
    };
    for (const Piece& piece : pieces) {
      run_to(kOpened + piece.at);
      Note(ear.Feed(ToBytes(piece.bytes), kOpened + piece.at), kOpened + piece.at);
    }
    run_to(kOpened + 1h);
    EXPECT_FALSE(ear.receiving());
  }

  std::string messages_;
  std::size_t damaged_ = 0;
  Bytes rest_;
};

TEST_P(UnaskedReceiverTest, ReportsTheExpectedMessagesOfEachInput) {
  const Case& one = GetParam();
  Play(one.pieces, one.rule);
  EXPECT_EQ(messages_, one.messages.empty() ? "" : one.messages + " ");
  EXPECT_EQ(damaged_, one.damaged);
  EXPECT_EQ(AsText(rest_), one.rest);
}

const std::vector<Case> kCases = {
    {"Whole", Bracketed, {{1s, "<abc>"}}, "<abc>@1000"},
    {"InPieces", Bracketed, {{1s, "<a"}, {1020ms, "b"}, {1040ms, "c>"}}, "<abc>@1040"},
    {"TwoInOneRead", Bracketed, {{1s, "<a><b>"}}, "<a>@1000 <b>@1000"},
    {"SecondMessageInTwoReads", Bracketed, {{1s, "<a><b"}, {1010ms, ">"}}, "<a>@1000 <b>@1010"},
    {"NoiseBetween", Bracketed, {{1s, "xx<a>yy<b>"}}, "<a>@1000 <b>@1000", 2, "xxyy"},
    {"StopsHalfWay", Bracketed, {{1s, "<ab"}, {2s, "<c>"}}, "<c>@2000", 1, "<ab"},
    {"DamagedParts", Bracketed, {{1s, "x"}, {1010ms, "y"}, {1020ms, "z"}}, "", 1, "xyz"},
    {"RightAfterTheOpening", Bracketed, {{0ms, "c><d>"}}, "<d>@0", 1, "c>"},
    {"TooLong",
     Bracketed,
     {{1s, "<" + std::string(40, 'a')}, {2s, "<b>"}},
     "<b>@2000",
     1,
     "<" + std::string(40, 'a')},
    {"TooSlow",
     Bracketed,
     {{1s, "<a"},
      {1040ms, "a"},
      {1080ms, "a"},
      {1120ms, "a"},
      {1160ms, "a"},
      {1199ms, "a"},
      {1230ms, "a>"},
      {1240ms, "<b>"}},
     "<b>@1240",
     1,
     "a>"},
    {"EndedWhole", Ended, {{1s, "abc\r"}}, "abc\\r@1000"},
    {"EndedInPieces", Ended, {{1s, "a"}, {1049ms, "b\r"}}, "ab\\r@1049"},
    {"EndedTwice", Ended, {{1s, "a\rb\r"}}, "a\\r@1000 b\\r@1000"},
    {"EndedOpenedInTheMiddle", Ended, {{10ms, "34\r"}, {20ms, "56\r"}}, "56\\r@20", 1},
    {"EndedOpenedInTheSilence", Ended, {{50ms, "34\r"}}, "34\\r@50"},
    {"EndedRestOfABrokenMessage",
     Ended,
     {{1s, "12"}, {1060ms, "34\r"}, {1070ms, "56\r"}},
     "56\\r@1070",
     2,
     "12"},
    {"EndedStops", Ended, {{1s, "12"}, {1200ms, "34\r"}}, "34\\r@1200", 1, "12"},
    {"SilenceEnds", Silent, {{1s, "ab"}, {1040ms, "c"}}, "abc@1040"},
    {"SilenceEndsTwo", Silent, {{1s, "ab"}, {1050ms, "c"}}, "ab@1000 c@1050"},
    {"SilenceOpenedInTheMiddle", Silent, {{10ms, "ab"}, {1s, "c"}}, "c@1000", 1},
    {"SilenceTooSlow",
     Silent,
     {{1s, "1"},
      {1040ms, "2"},
      {1080ms, "3"},
      {1120ms, "4"},
      {1160ms, "5"},
      {1199ms, "6"},
      {1230ms, "7"},
      {2s, "8"}},
     "8@2000",
     1}};

INSTANTIATE_TEST_SUITE_P(UnaskedReceiver, UnaskedReceiverTest, ::testing::ValuesIn(kCases),
                         [](const auto& info) { return info.param.name; });

class UnaskedReceiverCutTest : public UnaskedReceiverTest {};

TEST_F(UnaskedReceiverCutTest, AnyTwoCutsGiveTheSameMessages) {
  const std::string stream = "<abc><d>";
  for (std::size_t i = 0; i <= stream.size(); ++i) {
    for (std::size_t j = i; j <= stream.size(); ++j) {
      messages_.clear();
      Play({{1s, stream.substr(0, i)}, {1s, stream.substr(i, j - i)}, {1s, stream.substr(j)}},
           Bracketed);
      EXPECT_EQ(messages_, "<abc>@1000 <d>@1000 ") << i << " " << j;
      EXPECT_EQ(damaged_, 0U);
    }
  }
}

TEST_F(UnaskedReceiverCutTest, ALateTimerDoesNotJoinMessages) {
  const protocols::Standing standing = StandingOf(Silent);
  UnaskedReceiver ear(standing);
  ear.Begin(kOpened);
  Note(ear.Feed(ToBytes("12"), kOpened + 1s), kOpened + 1s);
  Note(ear.Feed(ToBytes("34"), kOpened + 1200ms), kOpened + 1200ms);
  Note(ear.OnTimer(kOpened + 1250ms), kOpened + 1250ms);
  EXPECT_EQ(messages_, "12@1000 34@1200 ");
}

TEST_F(UnaskedReceiverCutTest, MemoryIsBounded) {
  const protocols::Standing standing = StandingOf(Ended);
  UnaskedReceiver ear(standing);
  ear.Begin(kOpened);
  for (int i = 0; i < 1000; ++i) {
    const UnaskedInput heard = ear.Feed(ToBytes("noise without an end"), kOpened + 1s);
    EXPECT_LE(heard.rest.size(), 40U);
  }
}

protocols::Cut Message(View held, const protocols::Expectation&, bool) {
  if (held[0] != '<') return protocols::Cut::Discard(1, Outcome::none, "no message");
  const auto end = std::find(held.begin(), held.end(), '>');
  if (end == held.end()) return protocols::Cut::NeedMore();
  return protocols::Cut::Frame(static_cast<std::size_t>(end - held.begin()) + 1);
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
  void Start(Duration at,
             protocols::Expectation::Reply reply = protocols::Expectation::Reply::one) {
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

  const protocols::Standing standing_{
      .rule = Message,
      .expect = {.reply = protocols::Expectation::Reply::standing, .max_bytes = 32},
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

TEST_F(LineUnaskedTest, AMessageOnAnIdleLineIsReceived) {
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

TEST_F(LineUnaskedTest, BytesOnAnIdleLineAreNotCountedAsStray) {
  Start(1s);
  Bytes_(reply_, 1030ms);
  ASSERT_EQ(frames_.size(), 1U);
  Bytes_(reply_, 2s);
  EXPECT_EQ(strays_, 0U) << "nor is it told as a late reply";
}

TEST_F(LineUnaskedTest, AReplyDoesNotGoOnAfterTheProgramWasStopped) {
  Start(1s);
  Bytes_(reply_.substr(0, 3), 1020ms);
  Bytes_(reply_.substr(3), 1150ms);
  EXPECT_THAT(frames_, ::testing::IsEmpty());
  EXPECT_EQ(ends_, std::vector{Outcome::partial});
}

TEST_F(LineUnaskedTest, AnIncompleteMessageIsDamagedAndFreesTheLine) {
  Bytes_("<a", 1s);
  Timer(1020ms);
  EXPECT_TRUE(line_.idle());
  EXPECT_EQ(damaged_, 1U);
}

TEST_F(LineUnaskedTest, AMessageInsideAReplyIsRemovedFromTheReply) {
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

TEST_F(LineUnaskedTest, AMessageIsNoReplyAndDoesNotEndTheReplyTime) {
  Start(1s);
  Bytes_("<tag>", 1050ms);
  EXPECT_TRUE(ends_.empty());
  EXPECT_EQ(line_.Deadline(), At(1104ms));
  Timer(1104ms);
  EXPECT_EQ(ends_, std::vector{Outcome::no_reply});
  EXPECT_EQ(said_, Said{"<tag>"});
}

TEST_F(LineUnaskedTest, AMessageAnswersARequestThatExpectsAMessage) {
  Start(1s, protocols::Expectation::Reply::standing);
  Bytes_("<a><b>", 1050ms);
  EXPECT_EQ(ends_, std::vector{Outcome::ok});
  EXPECT_EQ(frames_, Said{"<a>"});
  EXPECT_EQ(said_, (Said{"<a>", "<b>"})) << "it is a message all the same";
  EXPECT_TRUE(line_.idle());
}

TEST_F(LineUnaskedTest, MessagesInDrainAndQuietAreReceived) {
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

TEST_F(LineUnaskedTest, BabbleDelaysARequestNoLongerThanTheCeiling) {
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

TEST_F(LineUnaskedTest, ALostPortDropsTheMessageInProgress) {
  Bytes_("<a", 1s);
  Keep(line_.OnClosed());
  EXPECT_EQ(line_.Deadline(), std::nullopt);
  line_.OnOpened(At(2s));
  EXPECT_TRUE(line_.idle());
  Bytes_("b><c>", 2s);
  EXPECT_EQ(said_, Said{"<c>"});
}

TEST(Transmission, KeepsEarlyBytesOnlyOnAPortThatKeepsItsBitRate) {
  Transmission sent;
  sent.OnOpened(false);
  sent.Begin(kStart, 4ms);
  EXPECT_EQ(sent.until() - sent.from(), 4ms);
  EXPECT_FALSE(sent.Keeps(ToBytes("ab")));
  EXPECT_FALSE(sent.has_early());
  sent.OnOpened(true);
  EXPECT_TRUE(sent.Keeps(ToBytes("ab")));
  EXPECT_TRUE(sent.Keeps(ToBytes("c")));
  EXPECT_EQ(sent.TakeEarly(), ToBytes("abc"));
  EXPECT_FALSE(sent.has_early());
  sent.OnEarlyReply();
  EXPECT_FALSE(sent.Keeps(ToBytes("d"))) << "the port only claimed it";
}

TEST(Transmission, ForgetsTheEarlyBytesOfThePreviousRequest) {
  Transmission sent;
  sent.OnOpened(true);
  sent.Begin(kStart, 4ms);
  sent.Keeps(ToBytes("late"));
  sent.Begin(kStart + 1s, 4ms);
  EXPECT_FALSE(sent.has_early());
}

TEST(Transmission, MemoryIsBounded) {
  Transmission sent;
  sent.OnOpened(true);
  sent.Begin(kStart, 1h);
  for (int i = 0; i < 1000; ++i) EXPECT_TRUE(sent.Keeps(Bytes(100, 'U')));
  EXPECT_LE(sent.TakeEarly().size(), Transmission::kMostKept + 100);
}

}  // namespace
}  // namespace baudgate::bus
