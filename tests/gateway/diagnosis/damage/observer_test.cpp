// Tests what the observer reports about an exchange after its end.
// SPDX-License-Identifier: Apache-2.0
#include "gateway/diagnosis/observer.h"

#include <gtest/gtest.h>

#include "tests/gateway/bus/poller/part_fixture.h"
#include "tests/support/times.h"

namespace baudgate::diagnosis {
namespace {

class ObserverTest : public ::testing::Test, protected bus::ToyMembers {
 protected:
  config::Config config_ = bus::ToyConfig();
  bus::PointStore store_{config_};
  Observer observer_{roster, store_};
};

TEST_F(ObserverTest, AReplyAfterTheEndAmendsTheFindingBeforeTheNextRequest) {
  observer_.OnRequest(a, bus::AskFor("?A1\r"), kStart);
  EXPECT_EQ(observer_.TakeFinding(Outcome::no_reply).symptom, Symptom::silence);
  EXPECT_TRUE(observer_.TakeChanged().empty());
  observer_.Hear(ToyReply("A1=5"), kStart + 500ms);
  const std::vector<EarlierFinding> changed = observer_.TakeChanged();
  ASSERT_EQ(changed.size(), 1U);
  EXPECT_EQ(changed[0].member, &a);
  EXPECT_EQ(changed[0].finding.symptom, Symptom::late);
  EXPECT_TRUE(observer_.TakeChanged().empty()) << "told once";
}

TEST_F(ObserverTest, ASecondReplyAfterARetryIsLateWheneverItIsFound) {
  for (const bool repeated : {true, false}) {
    Observer observer(roster, store_);
    const auto answer = [&](std::string_view body, Instant now) {
      const Bytes frame = ToyReply(body);
      observer.Hear(frame, now);
      observer.OnReply(frame);
      return observer.TakeFinding(Outcome::ok).symptom;
    };
    if (repeated) {
      observer.OnRequest(a, bus::AskFor("?A1\r"), kStart);
      observer.TakeFinding(Outcome::no_reply);
    }
    observer.OnRequest(a, bus::AskFor("?A1\r"), kStart + 1s);
    EXPECT_EQ(answer("A1=5", kStart + 1100ms), Symptom::clean);
    observer.OnRequest(a, bus::AskFor("?A2\r"), kStart + 2s);
    observer.Hear(ToyReply("A1=6"), kStart + 2050ms);
    EXPECT_EQ(answer("A2=5", kStart + 2100ms), repeated ? Symptom::clean : Symptom::others_beside);
    const std::vector<EarlierFinding> changed = observer.TakeChanged();
    ASSERT_EQ(changed.size(), repeated ? 1U : 0U);
    if (!repeated) continue;
    EXPECT_EQ(changed[0].finding.symptom, Symptom::late);
    EXPECT_EQ(changed[0].back, 2U);
  }
}

}  // namespace
}  // namespace baudgate::diagnosis
