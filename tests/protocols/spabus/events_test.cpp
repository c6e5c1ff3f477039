// Tests events: their text in both directions, and the event register of the simulated device.
// SPDX-License-Identifier: Apache-2.0
#include "protocols/spabus/events.h"

#include <gmock/gmock.h>

#include "protocols/spabus/twin.h"
#include "tests/protocols/spabus/support.h"

namespace baudgate::protocols::spabus {
namespace {

TEST(SpaEventText, IsParsed) {
  struct Case {
    const char* text;
    std::uint32_t channel;
    std::uint32_t code;
    std::optional<Duration> time;
    const char* rest;
  };
  // The first case is an example of the reference. The other cases are forms that the reference
  // allows.
  const Case cases[] = {
      {"12.345 0E1", 0, 1, 12'345ms, ""},
      {"12.345 E51", 0, 51, 12'345ms, ""},
      {"12.345 14E17", 14, 17, 12'345ms, ""},
      {"12.3450E1", 0, 1, 12'345ms, ""},
      {"12.345E1", 0, 1, 12'345ms, ""},
      {"1.000 0E3", 0, 3, 1s, ""},
      {" 59.999 999E999999 ", 999, 999'999, 59'999ms, ""},
      {"00.000 0E1 0.52", 0, 1, 0ms, "0.52"},
      // Text that does not fit is stored unchanged.
      {"12.345 0Q1 0.52", 0, 0, 12'345ms, "12.345 0Q1 0.52"},
      {"60.000 0E1", 0, 0, std::nullopt, "60.000 0E1"},
      {"12.34 0E1", 0, 0, std::nullopt, "12.34 0E1"},
      {"26-11-23 10.00;12.345 0E1", 0, 0, std::nullopt, "26-11-23 10.00;12.345 0E1"},
      {"12.345 0E0", 0, 0, 12'345ms, "12.345 0E0"},
      {"12.345 0E1x", 0, 0, 12'345ms, "12.345 0E1x"},
      {"12.345", 0, 0, 12'345ms, "12.345"},
      {"E1", 0, 0, std::nullopt, "E1"},
      {"?", 0, 0, std::nullopt, "?"},
  };
  for (const Case& one : cases) {
    const auto events = ParseEvents(one.text);
    ASSERT_EQ(events.size(), 1U) << one.text;
    EXPECT_EQ(events[0].code, one.code) << one.text;
    EXPECT_EQ(events[0].channel, one.channel) << one.text;
    EXPECT_EQ(events[0].time.has_value(), one.time.has_value()) << one.text;
    if (events[0].time && one.time) {
      EXPECT_EQ(events[0].time->time, *one.time) << one.text;
      EXPECT_EQ(events[0].time->period, 1min);
    }
    EXPECT_EQ(events[0].text, one.rest) << one.text;
  }
}

TEST(SpaEventText, HasAnEventInEachPart) {
  EXPECT_TRUE(ParseEvents("").empty());
  EXPECT_TRUE(ParseEvents("  ").empty());
  EXPECT_EQ(ParseEvents("12.345 0E1/12.410 0E3").size(), 2U);
  EXPECT_EQ(ParseEvents("12.345 0E1/").size(), 2U) << "nothing is dropped";
}

TEST(SpaEventText, IsDistinguishedFromOtherReplies) {
  for (const char* text : {"", "12.345 0E1", "12.345 0E1/12.410 0E3", "12.3450E1", "12.345 Q1 5"}) {
    EXPECT_TRUE(LooksLikeEvents(text)) << text;
  }
  for (const char* text : {"0", "0.52", "0.52/0.49", "SPCJ 4D29", "037_", "12.345 0E1/7"}) {
    EXPECT_FALSE(LooksLikeEvents(text)) << text;
  }
}

TEST(SpaEventText, IsPrintedLikeARelay) {
  EXPECT_EQ(PrintEvent({0, 1, SaidTime{12'345ms, 1min}, ""}), "12.345 0E1");
  EXPECT_EQ(PrintEvent({2, 17, SaidTime{5ms, 1min}, "0.5"}), "00.005 2E17 0.5");
  EXPECT_EQ(PrintEvent({0, 51, std::nullopt, ""}), "00.000 0E51");
}

class SpaTwinEvents : public ::testing::Test {
 protected:
  SpaTwinEvents()
      : device_(MakeDevice({MakePoint("I1")})),
        twin_(SpabusProtocol().make_twin(device_, values_)) {}

  /// The reply from `<` to the last colon.
  std::string Heard(const std::string& request) {
    const Bytes reply = twin_->Answer(ToBytes(request + "\r"), {});
    const std::string text(AsText(reply));
    return text.empty() ? "" : text.substr(1, text.rfind(':'));
  }
  bool Raise(std::uint32_t code, Duration at) {
    return twin_->Raise({0, code, {}, {}}, {Instant(), WallTime(at)});
  }

  config::Device device_;
  FixedValues values_;
  std::unique_ptr<Twin> twin_;
};

TEST_F(SpaTwinEvents, AreRemovedByLAndRepeatedByB) {
  EXPECT_TRUE(Raise(1, 12'345ms));
  EXPECT_TRUE(Raise(3, 72'410ms));
  EXPECT_EQ(Heard(">1RB:25"), "<1D::") << "nothing was given yet";
  EXPECT_EQ(Heard(">1RL:2B"), "<1D:12.345 0E1/12.410 0E3:");
  EXPECT_EQ(Heard(">1RB:25"), "<1D:12.345 0E1/12.410 0E3:");
  EXPECT_EQ(Heard(">1RB:25"), "<1D:12.345 0E1/12.410 0E3:");
  EXPECT_EQ(Heard(">1RL:2B"), "<1D::");
  EXPECT_EQ(Heard(">1RB:25"), "<1D::") << "forgotten";
}

TEST_F(SpaTwinEvents, AreSentFiveAtATimeAndOverflow) {
  for (std::uint32_t code = 1; code <= 65; ++code) EXPECT_TRUE(Raise(code % 8 + 1, 1s));
  EXPECT_EQ(Heard(">1RC:XX"), "<1D:0:");
  EXPECT_FALSE(Raise(1, 2s));
  EXPECT_FALSE(Raise(2, 3s));
  EXPECT_EQ(Heard(">1RC:XX"), "<1D:2:");
  for (int i = 0; i < 13; ++i) {
    EXPECT_EQ(ParseEvents(Heard(">1RL:XX")).size(), 5U) << i;
  }
  EXPECT_EQ(Heard(">1RL:XX"), "<1D:02.000 0E51:") << "the last one";
  EXPECT_EQ(Heard(">1RL:XX"), "<1D::");
  EXPECT_EQ(Heard(">1WC:0:2B"), "<1A:");
  EXPECT_EQ(Heard(">1RC:XX"), "<1D:0:");
}

using ::testing::HasSubstr;

constexpr unsigned kSlave = 1;
constexpr int kUnknownItem = 5;

class EventSessionTest : public ::testing::Test {
 protected:
  char Ask() { return session_.Next(kSlave).category; }
  void AnswerNothing() {
    Exchange exchange;
    session_.OnAnswer(std::move(exchange), now_ += 1s);
  }
  Then Refuse(int nack) {
    Exchange exchange;
    exchange.answer.outcome = Outcome::unsupported;
    exchange.nack = nack;
    return session_.OnAnswer(std::move(exchange), now_ += 1s).then;
  }
  void AskUpToL() {
    while (Ask() != 'L') AnswerNothing();
  }

  EventSession session_{true, false};
  Instant now_{1h};
};

TEST_F(EventSessionTest, ARelayThatRefusesThreeTimesIsNotAskedAgain) {
  AskUpToL();
  Refuse(kUnknownItem);
  EXPECT_TRUE(session_.has_events()) << "a damaged reply may look like that";
  AskUpToL();
  Refuse(kUnknownItem);
  AskUpToL();
  EXPECT_EQ(Refuse(kUnknownItem), Then::replan);
  EXPECT_FALSE(session_.has_events());
  EXPECT_THAT(session_.remark().text, HasSubstr("refuses the request L"));
  EXPECT_EQ(session_.remark().reason, Reason::none) << "its values are good";
  session_.OnReconnect();
  EXPECT_TRUE(session_.has_events());
  EXPECT_EQ(session_.remark().text, "");
}

TEST_F(EventSessionTest, ARelayThatHasAnsweredIsStillAsked) {
  AskUpToL();
  AnswerNothing();
  for (int i = 0; i < 100; ++i) {
    AskUpToL();
    Refuse(kUnknownItem);
    EXPECT_TRUE(session_.has_events());
  }
  EXPECT_THAT(session_.remark().text, HasSubstr("refuses the request L"));
  AskUpToL();
  AnswerNothing();
  EXPECT_EQ(session_.remark().text, "");
}

TEST_F(EventSessionTest, ReportsUnreadableEvents) {
  for (int i = 0; i < 20; ++i) {
    Ask();
    session_.OnFailure(Outcome::corrupt);
  }
  EXPECT_THAT(session_.remark().text, HasSubstr("cannot be read"));
  AskUpToL();
  EXPECT_EQ(session_.remark().text, "");
}

constexpr const char* kOne = "12.345 1E100";
constexpr const char* kOther = "12.345 2E103";

class HeldEvents : public ::testing::Test {
 protected:
  Answer Say(char wanted, const std::string& data) {
    EXPECT_EQ(session_->Next(kSlave).category, wanted);
    Exchange exchange;
    exchange.data = data;
    return session_->OnAnswer(std::move(exchange), now_ += 1s);
  }
  void Fail(char wanted) {
    EXPECT_EQ(session_->Next(kSlave).category, wanted);
    session_->OnFailure(Outcome::no_reply);
  }
  void Begin(bool rechecks) {
    session_.emplace(true, rechecks);
    Say('B', "");
    Say('C', "0");
  }
  static std::string SaidIn(const Answer& answer) {
    if (!answer.batch) return answer.then == Then::ask_again ? "more" : "none";
    return answer.batch->said + (answer.batch->again ? " again" : "");
  }

  std::optional<EventSession> session_;
  Instant now_{1h};
};

TEST_F(HeldEvents, AreReportedWhenTheBackupIsEqual) {
  Begin(true);
  EXPECT_EQ(SaidIn(Say('L', kOne)), "more");
  EXPECT_EQ(SaidIn(Say('B', kOne)), kOne);
  EXPECT_EQ(SaidIn(Say('L', "")), "") << "drained";
}

TEST_F(HeldEvents, OfADamagedReplyAreNeverReported) {
  Begin(true);
  EXPECT_EQ(SaidIn(Say('L', kOther)), "more");
  EXPECT_EQ(SaidIn(Say('B', kOne)), "none") << "one of the two is damaged";
  EXPECT_EQ(SaidIn(Say('B', kOne)), std::string(kOne) + " again");
}

TEST_F(HeldEvents, AreNotLostWhileTheBackupIsSilent) {
  Begin(true);
  Say('L', kOne);
  for (int i = 0; i < 30; ++i) Fail('B');
  EXPECT_EQ(SaidIn(Say('B', kOne)), kOne) << "it has answered B before";
}

/// L removes events from the relay, so the events of a lost reply are only in the backup (B).
TEST_F(HeldEvents, OfALostReplyAreReadFromTheBackup) {
  Begin(false);
  Fail('L');
  EXPECT_EQ(SaidIn(Say('B', kOne)), std::string(kOne) + " again");
  EXPECT_EQ(SaidIn(Say('L', "")), "");
}

TEST_F(HeldEvents, AreReportedIfTheRelayHasNoBackup) {
  session_.emplace(true, true);
  for (int i = 0; i < 3; ++i) Fail('B');
  Say('C', "0");
  EXPECT_EQ(SaidIn(Say('L', kOne)), kOne);
}

TEST_F(HeldEvents, EqualToThePreviousAreNewIfTheBackupConfirmsThem) {
  Begin(false);
  EXPECT_EQ(SaidIn(Say('L', kOne)), kOne);
  for (int batch = 0; batch < 3; ++batch) {
    EXPECT_EQ(SaidIn(Say('L', kOne)), "more") << "it may be a late reply";
    EXPECT_EQ(SaidIn(Say('B', kOne)), kOne);
  }
  EXPECT_EQ(SaidIn(Say('L', kOne)), "more");
  EXPECT_EQ(SaidIn(Say('B', kOther)), std::string(kOther) + " again") << "it was";
  EXPECT_EQ(SaidIn(Say('L', kOther)), "more");
  EXPECT_EQ(SaidIn(Say('B', "")), "more") << "and so was this";
  EXPECT_EQ(SaidIn(Say('L', "")), "");
}

}  // namespace
}  // namespace baudgate::protocols::spabus
