// The steps of taking events out of a relay, where it refuses or is not understood.
// SPDX-License-Identifier: Apache-2.0
#include "protocols/spabus/event_session.h"

#include <gmock/gmock.h>

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

  EventSession session_{true};
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
  EXPECT_THAT(session_.remark().text, HasSubstr("can not be read"));
  AskUpToL();
  EXPECT_EQ(session_.remark().text, "");
}

}  // namespace
}  // namespace baudgate::protocols::spabus
