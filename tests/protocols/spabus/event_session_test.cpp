// The steps of taking events out of a relay, where it refuses or is not understood.
// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>

#include "protocols/spabus/events.h"

namespace baudgate::protocols::spabus {
namespace {

using ::testing::HasSubstr;

constexpr unsigned kSlave = 1;
constexpr int kUnknownItem = 5;

/// What stands for B, C and L, answered alike.
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

TEST_F(EventSessionTest, ARelayThatRefusesThreeIsLeftInPeace) {
  AskUpToL();
  Refuse(kUnknownItem);
  EXPECT_TRUE(session_.has_events()) << "a damaged reply may look like that";
  AskUpToL();
  Refuse(kUnknownItem);
  AskUpToL();
  EXPECT_EQ(Refuse(kUnknownItem), Then::replan);
  EXPECT_FALSE(session_.has_events());
  EXPECT_THAT(session_.remark().text, HasSubstr("refuses L"));
  EXPECT_EQ(session_.remark().reason, Reason::none) << "its values are good";
  session_.OnReconnect();
  EXPECT_TRUE(session_.has_events());
  EXPECT_EQ(session_.remark().text, "");
}

TEST_F(EventSessionTest, ARelayThatHasAnsweredIsAskedOn) {
  AskUpToL();
  AnswerNothing();
  for (int i = 0; i < 100; ++i) {
    AskUpToL();
    Refuse(kUnknownItem);
    EXPECT_TRUE(session_.has_events());
  }
  EXPECT_THAT(session_.remark().text, HasSubstr("refuses L"));
  AskUpToL();
  AnswerNothing();
  EXPECT_EQ(session_.remark().text, "");
}

TEST_F(EventSessionTest, SaysThatItsEventsCanNotBeRead) {
  for (int i = 0; i < 20; ++i) {
    Ask();
    session_.OnFailure(Outcome::corrupt);
  }
  EXPECT_THAT(session_.remark().text, HasSubstr("cannot be read"));
  AskUpToL();
  EXPECT_EQ(session_.remark().text, "");
}

constexpr const char* kOne = "12.345 1E100";
constexpr const char* kOther = "12.345 2E103";  // the same check value

/// Where damage may look whole, and where the same may be said twice.
class HeldEvents : public ::testing::Test {
 protected:
  /// What is asked, which has to be `wanted`, is answered so.
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

TEST_F(HeldEvents, CountWhenTheBackupSaysTheSame) {
  Begin(true);
  EXPECT_EQ(SaidIn(Say('L', kOne)), "more");
  EXPECT_EQ(SaidIn(Say('B', kOne)), kOne);
  EXPECT_EQ(SaidIn(Say('L', "")), "") << "drained";
}

TEST_F(HeldEvents, OfADamagedReplyNeverCount) {
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

/// L takes events out of the relay: what the lost reply held is in B alone.
TEST_F(HeldEvents, OfALostReplyComeFromTheBackup) {
  Begin(false);
  Fail('L');
  EXPECT_EQ(SaidIn(Say('B', kOne)), std::string(kOne) + " again");
  EXPECT_EQ(SaidIn(Say('L', "")), "");
}

TEST_F(HeldEvents, CountAloneWhereTheRelayKnowsNoBackup) {
  session_.emplace(true, true);
  for (int i = 0; i < 3; ++i) Fail('B');
  Say('C', "0");
  EXPECT_EQ(SaidIn(Say('L', kOne)), kOne);
}

TEST_F(HeldEvents, ThatLookLikeThoseBeforeAreNew) {
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
