// What is said of a device that answers: failures now and then, late or second replies, its points.
// SPDX-License-Identifier: Apache-2.0
#include "gateway/status/diagnose.h"

#include <string>

#include "tests/gateway/status/diagnose_fixture.h"

namespace baudgate::control {
namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;

TEST_F(DiagnoseTest, AHealthyDeviceIsNotTalkedAbout) {
  EXPECT_THAT(Say(), IsEmpty());
  EXPECT_THAT(SayOfLine(), IsEmpty());
  Ended(Outcome::no_reply, 1);
  Ended(Outcome::corrupt, 1);
  Ended(Outcome::ok, 1);
  EXPECT_THAT(Say(), IsEmpty()) << "one of a thousand is no news";
}

TEST_F(DiagnoseTest, FailuresNowAndThen) {
  const std::string settings = "(address 2, 9600 7E1)";
  const struct {
    Outcome outcome;
    std::uint32_t count;
    std::string reason;
    std::string sentence;
  } rows[] = {
      {Outcome::corrupt, 30, "",
       "corrupt in 30 of its last 64 exchanges: noise, bad termination or a bus without ground; if "
       "it is most of them, parity, data bits or checksum differ from the device's " +
           settings},
      {Outcome::partial, 3, "",
       "partial in 3 of its last 64 exchanges: answers stop half-way: raise its timing.gap if a "
       "radio or a serial server is in between, else check wiring"},
      {Outcome::unexpected, 2, "",
       "unexpected in 2 of its last 64 exchanges: frames of another address or shape, or that may "
       "belong to another request: a second master, two devices with one address, answers that "
       "come "
       "too late, or a lost one where nothing tells answers apart (see trust_order); look at "
       "'baudgate trace bay-1'"},
      {Outcome::no_reply, 2, "",
       "no_reply in 2 of its last 64 exchanges: it was off for a moment or misses requests: noise, "
       "or it is asked faster than it can (raise its poll or timing.quiet)"},
      {Outcome::busy, 7, "",
       "busy in 7 of its last 64 exchanges: it asks to be asked later: raise its poll"},
      {Outcome::refused, 20, "code 7",
       "refused in 20 of its last 64 exchanges: it does not have what the profile asks for (code "
       "7): does the profile fit?"},
      {Outcome::unsupported, 64, "",
       "unsupported in 64 of its last 64 exchanges: it does not have what the profile asks for: "
       "does the profile fit?"},
  };
  const DeviceStatus well = device();
  for (const auto& row : rows) {
    device() = well;
    Ended(row.outcome, row.count, row.reason);
    EXPECT_THAT(Say(), ElementsAre(row.sentence));
  }
}

TEST_F(DiagnoseTest, ASingleFailureIsSaidWhereItIsNoException) {
  Ended(Outcome::corrupt, 64);
  Ended(Outcome::ok, 63);
  EXPECT_THAT(Say(), ElementsAre(::testing::StartsWith("corrupt in 1 of its last 64 exchanges: ")));
}

TEST_F(DiagnoseTest, AnOutageIsNotHeldAgainstADeviceForEver) {
  Ended(Outcome::no_reply, 2000);
  Ended(Outcome::ok, 60);
  EXPECT_THAT(Say(), ElementsAre(::testing::StartsWith("no_reply in 4 of its last 64 exchanges: it "
                                                       "was off for a moment or")));
  Ended(Outcome::ok, 4);
  EXPECT_THAT(Say(), IsEmpty());
}

TEST_F(DiagnoseTest, LateAnswersAreNotMissedRequests) {
  Ended(Outcome::no_reply, 20);
  device().late = 17;
  device().lateness = 79'200us;
  EXPECT_THAT(Say(), ElementsAre("late: replies came up to 80 ms after they were due, 17 times: "
                                 "raise its timing.reply by more than 80 ms"));
}

TEST_F(DiagnoseTest, LateAnswersThatAreWaitedForAreSaidWithoutACountOfThoseThatWereLost) {
  Ended(Outcome::ok, 20);
  device().patience = 195'200us;
  EXPECT_THAT(Say(), ElementsAre("late: its replies come after timing.reply is over, and it is "
                                 "waited for 196 ms longer: raise its timing.reply by as much"));
}

TEST_F(DiagnoseTest, SecondRepliesAreSaidHoweverSeldom) {
  device().doubled = 1;
  EXPECT_THAT(Say(), ElementsAre(::testing::StartsWith(
                         "doubled: a second, different reply came behind one once: ")));
}

TEST_F(DiagnoseTest, PointsThatAreNotGood) {
  record_.age_limits[static_cast<std::size_t>(config::Group::fast)] = {3s, 9s};
  record_.points[0].read_at = kNow.instant - 4s;
  record_.points[0].reported = Quality::good;
  record_.points[1].read_at = kNow.instant;
  record_.points[1].reported = Quality::bad_sensor_failure;
  EXPECT_THAT(Say(), ElementsAre("1 of 2 points are older than their max_age: its polls fail or "
                                 "come too seldom; see 'baudgate status bay-1.feeder-2'",
                                 "1 of 2 points are not good by the device's own report; see "
                                 "'baudgate status bay-1.feeder-2'"));
}

TEST_F(DiagnoseTest, DoubtIsNotTheDevicesReport) {
  for (PointRecord& point : record_.points) {
    point.read_at = kNow.instant;
    point.reported = Quality::good;
  }
  record_.points[0].at_best = Quality::uncertain;
  EXPECT_THAT(
      Say(),
      ElementsAre("1 of 2 points are in doubt until they are read again: the port was opened "
                  "anew, the device was away, or a reply may have belonged to another "
                  "request; see 'baudgate status bay-1.feeder-2'"));
  record_.points[0].at_best = Quality::uncertain_last_usable;
  EXPECT_THAT(Say(),
              ElementsAre(::testing::HasSubstr("1 of 2 points are older than their max_age")));
}

TEST_F(DiagnoseTest, DegradedWithoutAnotherSentenceSaysTheLastTrouble) {
  device().state = DeviceState::degraded;
  Ended(Outcome::corrupt, 1, "checksum 3A is not 74");
  EXPECT_THAT(Say(), ElementsAre("degraded: several of its last 32 exchanges failed; last: "
                                 "checksum 3A is not 74"));
}

}  // namespace
}  // namespace baudgate::control
