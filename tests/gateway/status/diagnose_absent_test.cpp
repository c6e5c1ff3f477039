// What is said of devices that do not answer, or are not asked.
// SPDX-License-Identifier: Apache-2.0
#include <string>

#include "tests/gateway/status/diagnose_fixture.h"

namespace baudgate::control {
namespace {

using ::testing::ElementsAre;

TEST_F(DiagnoseTest, AbsentDevices) {
  line_.notice_bound = 9s;
  device().state = DeviceState::offline;
  device().last_ok = kNow.instant - 12min;
  const struct {
    Outcome outcome;
    std::string reason;
    std::string sentence;
  } rows[] = {
      {Outcome::no_reply, "",
       "offline for 12 min: no_reply; its return is noticed within 9.0 s; check power, address, "
       "bit rate, parity and wiring (address 2, 9600 7E1)"},
      {Outcome::corrupt, "checksum 3A is not 74",
       "offline for 12 min: corrupt (checksum 3A is not 74); its return is noticed within 9.0 s; "
       "its answers cannot be read: check parity, data bits and checksum (address 2, 9600 7E1), "
       "then noise, or a second device with its address"},
      {Outcome::partial, "",
       "offline for 12 min: partial; its return is noticed within 9.0 s; its answers stop "
       "half-way: raise its timing.gap, then check wiring"},
      {Outcome::unexpected, "",
       "offline for 12 min: unexpected; its return is noticed within 9.0 s; something else "
       "answers: check its address (2), and for a second master on the bus"},
  };
  for (const auto& row : rows) {
    Ended(row.outcome, 34, row.reason);
    EXPECT_THAT(Say(), ElementsAre(row.sentence));
  }
  device().late = 17;
  device().lateness = 80ms;
  EXPECT_THAT(Say(), ElementsAre("offline for 12 min: unexpected; its return is noticed within "
                                 "9.0 s; late: replies came up to 80 ms after they were due, 17 "
                                 "times: raise its timing.reply by more than 80 ms"));
}

TEST_F(DiagnoseTest, WhatTheServerSaidInPlaceOfADeviceIsQuoted) {
  NeverAnswered();
  line_.notice_bound = 9s;
  Ended(Outcome::no_reply, 34, "exception 0B: the gateway on the way has no answer");
  EXPECT_THAT(Say(), ElementsAre("has never answered: no_reply (exception 0B: the gateway on the "
                                 "way has no answer); nothing good came in 34 exchanges; its "
                                 "return is noticed within 9.0 s; check power, address, bit rate, "
                                 "parity and wiring (address 2, 9600 7E1)"));
}

TEST_F(DiagnoseTest, OfAServerNothingIsSaidOfBitRates) {
  config_.lines[0].serial = {.baud = config::SerialSettings::kNoWire};
  config_.lines[0].port = "tcp://10.0.0.7:502";
  NeverAnswered();
  line_.notice_bound = 9s;
  Ended(Outcome::no_reply, 34);
  EXPECT_THAT(Say()[0], ::testing::EndsWith("check its power, its address (2) and what is behind "
                                            "tcp://10.0.0.7:502"));
  Ended(Outcome::corrupt, 34);
  EXPECT_THAT(Say()[0],
              ::testing::EndsWith("its answers cannot be read: is there Modbus TCP at "
                                  "tcp://10.0.0.7:502? A serial server that passes Modbus RTU on "
                                  "needs protocol: modbus_rtu"));
}

TEST_F(DiagnoseTest, OfBytesAfterTheEndTheTrueCauseIsSaid) {
  device().state = DeviceState::offline;
  device().last_ok = kNow.instant - 12min;
  device().late = 3;
  Ended(Outcome::partial, 34);
  EXPECT_THAT(Say()[0], ::testing::EndsWith("its answers stop half-way: raise its timing.gap, then "
                                            "check wiring"));
  Ended(Outcome::no_reply, 34);
  EXPECT_THAT(Say()[0], ::testing::HasSubstr("check power")) << "late a few times, long ago";
  device().state = DeviceState::online;
  device().late = 17;
  Ended(Outcome::partial, 4);
  EXPECT_THAT(Say(),
              ElementsAre(::testing::StartsWith("partial in "), ::testing::StartsWith("late: ")));
}

TEST_F(DiagnoseTest, ADeviceThatHasNeverAnswered) {
  NeverAnswered();
  EXPECT_THAT(Say(), ElementsAre("not asked yet"));
  Ended(Outcome::no_reply, 34);
  EXPECT_THAT(Say(),
              ElementsAre("has never answered: no_reply; not a byte came in 34 exchanges; it is "
                          "asked again and again; check power, address, bit rate, parity and "
                          "wiring (address 2, 9600 7E1)"));
  Ended(Outcome::corrupt, 1);
  EXPECT_THAT(Say()[0], ::testing::StartsWith(
                            "has never answered: corrupt; nothing good came in 35 exchanges;"));
}

TEST_F(DiagnoseTest, AReaderThatIsAloneOnItsLine) {
  config_.lines[0].devices.erase(config_.lines[0].devices.begin());
  record_.device = &config_.lines[0].devices[0];
  NeverAnswered();
  device().unasked = true;
  line_.bytes_in = 200;
  Ended(Outcome::no_reply, 22);
  EXPECT_THAT(Say()[0],
              ::testing::StartsWith("has never answered: no_reply; nothing good came in 22 "
                                    "exchanges; its next message is waited for; check"));
}

TEST_F(DiagnoseTest, AfterAnOutageOfThePortADeviceIsNotBlamed) {
  device().state = DeviceState::offline;
  Ended(Outcome::line_down, 1, "the port is closed");
  EXPECT_THAT(Say(), ElementsAre("not asked since the port was opened"));
}

TEST_F(DiagnoseTest, DisabledDevices) {
  device().state = DeviceState::disabled;
  EXPECT_THAT(Say(), ElementsAre("taken out of use at run time; 'baudgate enable bay-1.feeder-2' "
                                 "brings it back"));
  config_.lines[0].devices[1].enabled = false;
  EXPECT_THAT(Say(), ElementsAre("disabled in the configuration (enabled: false)"));
}

}  // namespace
}  // namespace baudgate::control
