// What is said of devices that do not answer, or are not asked.
// SPDX-License-Identifier: Apache-2.0
#include <string>

#include "gateway/diagnosis/causes/evidence.h"
#include "tests/gateway/diagnosis/causes/diagnose_fixture.h"

namespace baudgate::control {
namespace {

using ::testing::ElementsAre;

TEST_F(DiagnoseTest, AnAbsentDeviceSaysSinceWhenWhyAndWhenItsReturnIsNoticed) {
  line_.notice_bound = 9s;
  device().state = DeviceState::offline;
  device().last_ok = kNow.instant - 12min;
  Ended(Outcome::no_reply, 34);
  EXPECT_THAT(Say(), ElementsAre("offline for 12 min: not a byte comes any more: check its power "
                                 "and its wire, or whether its settings were changed",
                                 "feeder-1 answers on the same line",
                                 "its return is noticed within 9.0 s"));
  NeverAnswered();
  EXPECT_THAT(Say(), ElementsAre("not asked yet"));
  Ended(Outcome::no_reply, 34);
  EXPECT_THAT(
      Say(),
      ElementsAre("has never answered: not a byte came: check its power and wire, then its address "
                  "(2), bit rate, parity and protocol (9600 7E1, spabus)",
                  "feeder-1 answers on the same line"));
}

TEST_F(DiagnoseTest, WhatAModemSaidBeforeTheSilenceIsItsCause) {
  const Finding said{.cause = "'NO CARRIER'", .remedy = "dial again"};
  for (const bool answered_since : {false, true}) {
    Looked(device(), Symptom::text_beside, 1, said);
    if (answered_since) Looked(device(), Symptom::clean, 1);
    device().state = DeviceState::offline;
    device().last_ok = kNow.instant - 12min;
    Ended(Outcome::no_reply, 34);
    EXPECT_EQ(Say()[0],
              answered_since
                  ? "offline for 12 min: not a byte comes any more: check its power and "
                    "its wire, or whether its settings were changed"
                  : "offline for 12 min: 'NO CARRIER' came, and nothing since: dial again");
  }
}

TEST_F(DiagnoseTest, DevicesFellTogetherOnlyIfTheyFellAtTheSameMoment) {
  device().state = neighbour_.status.state = DeviceState::offline;
  device().last_ok = kNow.instant - 12min;
  for (const bool together : {true, false}) {
    neighbour_.status.last_ok = *device().last_ok + (together ? 1s : 1min);
    const DeviceRecord both[] = {neighbour_, record_};
    EXPECT_EQ(Gather(line_, record_, both, kNow).fell, together ? "feeder-1" : "");
  }
}

TEST_F(DiagnoseTest, ADeviceOnItsWayBackIsNotTalkedAbout) {
  device().state = DeviceState::offline;
  device().last_ok = kNow.instant - 300ms;
  Ended(Outcome::ok, 2);
  EXPECT_THAT(Say(), ::testing::IsEmpty());
  neighbour_.status.state = DeviceState::offline;
  EXPECT_THAT(Say(), ::testing::IsEmpty()) << "nor is its line, whose port was lent";
  EXPECT_THAT(SayOfLine(), ::testing::IsEmpty());
}

TEST_F(DiagnoseTest, AfterAnOutageOfThePortADeviceIsNotBlamed) {
  device().state = DeviceState::offline;
  Ended(Outcome::line_down, 1, "the port is closed");
  EXPECT_THAT(Say(), ElementsAre("not asked since the port was opened"));
  NeverAnswered();
  Ended(Outcome::no_reply, 5);
  device().last_outcome = Outcome::line_down;
  EXPECT_THAT(Say(), ::testing::Contains(::testing::HasSubstr("not a byte came")))
      << "before the port was opened anew as well";
}

TEST_F(DiagnoseTest, DisabledDevices) {
  device().state = DeviceState::disabled;
  EXPECT_THAT(
      Say(),
      ElementsAre("taken out of use at run time; 'baudgate enable bay-1.feeder-2' brings it back"));
  config_.lines[0].devices[1].enabled = false;
  EXPECT_THAT(Say(), ElementsAre("disabled in the configuration (enabled: false)"));
}

}  // namespace
}  // namespace baudgate::control
