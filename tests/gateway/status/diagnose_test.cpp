// What is said of a device that answers: failures now and then, late or second replies, its points.
// SPDX-License-Identifier: Apache-2.0
#include "gateway/status/diagnose.h"

#include <bit>
#include <string>

#include "tests/gateway/status/diagnose_fixture.h"

namespace baudgate::control {
namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;

TEST_F(DiagnoseTest, AHealthyDeviceIsNotTalkedAbout) {
  EXPECT_THAT(Say(), IsEmpty());
  EXPECT_THAT(SayOfLine(), IsEmpty());
  Ended(Outcome::corrupt, 1);
  Ended(Outcome::ok, 1);
  EXPECT_THAT(Say(), IsEmpty()) << "one of a thousand is no news";
}

TEST_F(DiagnoseTest, FailuresNowAndThen) {
  const struct {
    Outcome outcome;
    std::uint32_t count;
    std::string reason;
    std::string sentence;
    std::string remedy{};
  } rows[] = {
      {Outcome::corrupt, 20, "checksum",
       "20 of 32 exchanges failed: its replies come damaged: a bad wire or plug at its end, or two "
       "devices have its address (2; unplug one)"},
      {Outcome::corrupt, 30, "checksum",
       "30 of 32 exchanges failed: its replies come damaged: two devices have its address (2; "
       "unplug one), or a bad wire at its end"},
      {Outcome::no_reply, 2, "",
       "2 of 32 exchanges failed: single requests get no answer: noise, a bad wire or plug at its "
       "end"},
      {Outcome::busy, 32, "exception 06",
       "it says 'exception 06' to 32 of 32 requests: end its programming, local or test mode, or "
       "restart it"},
      {Outcome::busy, 7, "function 03: exception 06, device busy",
       "it says 'function 03: exception 06, device busy' to 7 of 32 requests: raise its poll"},
      {Outcome::refused, 20, "exception 04, device failure",
       "it says 'exception 04, device failure' to 20 of 32 requests: look at it", "look at it"},
      {Outcome::unsupported, 64, "",
       "it says 'unsupported' to 32 of 32 requests: does the profile fit the device and its "
       "options?"},
  };
  const DeviceStatus well = device();
  for (const auto& row : rows) {
    device() = well;
    Ended(row.outcome, SymptomOf(row.outcome), row.count, row.reason,
          {.cause = row.reason, .remedy = row.remedy});
    EXPECT_THAT(Say(), ElementsAre(row.sentence));
  }
}

TEST_F(DiagnoseTest, LossesThatAreTooSeldomForTheLatestExchanges) {
  for (int i = 0; i < 5; ++i) {
    Ended(Outcome::no_reply, 1);
    Ended(Outcome::ok, 19);
  }
  Ended(Outcome::ok, 20);
  EXPECT_THAT(Say(), IsEmpty()) << "the exchanges of the fixture are many";
  device().failures = {};
  for (const int behind : {9, 30, 12, 25, 14, 29}) {
    Ended(Outcome::no_reply, 1);
    Ended(Outcome::ok, behind);
  }
  Ended(Outcome::ok, 15);
  EXPECT_THAT(Say(), ElementsAre("6 of 140 exchanges failed: single requests get no answer: noise, "
                                 "a bad wire or plug at its end"));
  Looked(device(), Symptom::damaged, 1);
  Ended(Outcome::ok, 32);
  EXPECT_THAT(Say(), IsEmpty()) << "there is another cause";
}

TEST_F(DiagnoseTest, DevicesThatAreAwayAtTheSameTime) {
  for (int i = 0; i < 4; ++i) {
    const Instant begin = looked_;
    Ended(Outcome::no_reply, 4);
    Ended(Outcome::ok, 12);
    looked_ = begin;
    Looked(neighbour_.status, Symptom::silence, 3);
    Looked(neighbour_.status, Symptom::clean, 13);
  }
  EXPECT_THAT(Say()[0], ::testing::EndsWith(
                            "it is away for about 4.0 s every 16 s, at the same time as " +
                            neighbour_.device->name +
                            ": look at the supply or the branch of the line that they share"));
}

TEST_F(DiagnoseTest, DevicesThatAreDamagedAtTheSameTime) {
  for (int i = 0; i < 4; ++i) {
    const Instant begin = looked_;
    Ended(Outcome::corrupt, 4);
    Ended(Outcome::ok, 12);
    looked_ = begin;
    Looked(neighbour_.status, Symptom::damaged, 3);
    Looked(neighbour_.status, Symptom::clean, 13);
  }
  EXPECT_THAT(Say()[0],
              ::testing::EndsWith("its replies come damaged at the same times as those of " +
                                  neighbour_.device->name +
                                  ": a bad contact or noise in what they share: check cable, "
                                  "termination and ground"));
}

/// While neighbours are silent as well, every request comes behind a rest.
TEST_F(DiagnoseTest, DevicesThatAreAwayAtTheSameTimeDoNotSleep) {
  for (int i = 0; i < 4; ++i) {
    const Instant begin = looked_;
    for (DeviceStatus* status : {&device(), &neighbour_.status}) {
      looked_ = begin;
      Looked(*status, Symptom::silence, 3, {.idle = 600ms});
      Looked(*status, Symptom::clean, 13, {.idle = 50ms});
    }
  }
  EXPECT_THAT(Say()[0], ::testing::HasSubstr(", at the same time as "));
}

TEST_F(DiagnoseTest, AnOutageIsNotHeldAgainstADeviceForEver) {
  Ended(Outcome::no_reply, 2000);
  Ended(Outcome::ok, 28);
  EXPECT_THAT(Say(), ElementsAre(::testing::StartsWith("4 of 32 exchanges failed: ")));
  Ended(Outcome::ok, 3);
  EXPECT_THAT(Say(), IsEmpty());
}

TEST_F(DiagnoseTest, OutagesOfTheLastHourAreCounted) {
  Minute().outages = 1;
  Minute().up = 59min;
  Minute().down = 10s;
  EXPECT_THAT(Say(), IsEmpty()) << "a restart is no news";
  Minute().outages = 9;
  Minute().down = 10min;
  EXPECT_THAT(
      Say(),
      ElementsAre(
          "9 outages in the last hour, and it answered 86 % of the time: look at its power and its "
          "wire"));
  device().hour.At(kNow.instant) = {};
  device().hour.At(kNow.instant - 61min).outages = 9;
  EXPECT_THAT(Say(), IsEmpty());
}

TEST_F(DiagnoseTest, ARequestThatIsNeverAnsweredBesideOthers) {
  device().queries = {{.first_point = 0, .points = 1},
                      {.first_point = 1, .points = 3, .in_vain = 5, .symptom = Symptom::silence}};
  const std::string name = record_.device->points[1].name;
  EXPECT_THAT(Say(), ElementsAre("does not answer the request for " + name + " and 2 more (" +
                                 record_.device->points[1].read +
                                 "), and answers the others: take these points out "
                                 "of the profile, or set access: none"));
  Looked(device(), Symptom::silence, 1, {.ended = true});
  EXPECT_THAT(Say(), ElementsAre(::testing::StartsWith("ends the connection at the request for " +
                                                       name + " and 2 more (")));
  device().findings = {};
  Looked(device(), Symptom::clean, 24);
  device().queries[1].symptom = Symptom::damaged;
  Looked(device(), Symptom::damaged, 8);
  EXPECT_THAT(Say(), ElementsAre(::testing::StartsWith(
                         "the replies for " + name + " and 2 more come damaged, and no others: ")));
  device().queries[0].failures = 0b1010;
  EXPECT_THAT(Say(), ElementsAre(::testing::StartsWith("8 of 32 exchanges failed: ")))
      << "others fail now and then as well";
  device().queries[0].failures = 0;
  device().findings = {};
  Looked(device(), Symptom::clean, 9);
  device().queries[0] = device().queries[1];
  EXPECT_THAT(Say(), IsEmpty()) << "it answers none";
}

TEST_F(DiagnoseTest, ReadingsThatAreNotConfirmed) {
  device().exchanges = 100;
  device().unconfirmed = 4;
  EXPECT_THAT(Say(), ElementsAre("4 of its readings changed when they were read again: replies "
                                 "come damaged, and no check value shows it: switch its checksum "
                                 "on, here too, and look for noise"));
  device().exchanges = 101;
  EXPECT_THAT(Say(), IsEmpty());
}

TEST_F(DiagnoseTest, ARequestThatIsAnsweredInAnotherWayIsNotSilent) {
  for (PointRecord& point : record_.points) point.reported = Quality::bad_waiting;
  device().queries = {{.first_point = 0, .points = 1},
                      {.first_point = 1, .points = 1, .in_vain = 5, .symptom = Symptom::odd}};
  device().last_reason = "6 values came where 8 channels are configured";
  Looked(device(), Symptom::clean, 32);
  EXPECT_THAT(Say()[0],
              ::testing::StartsWith("only the request for " + record_.device->points[1].name +
                                    " fails: its reply "
                                    "does not fit (6 values came where 8 channels"));
}

TEST_F(DiagnoseTest, OnlyWhatNoPollAsksIsAnswered) {
  device().queries = {{.first_point = 1, .points = 1, .in_vain = 3, .symptom = Symptom::silence}};
  record_.points[0].value = 1.5;
  for (int i = 0; i < 3; ++i) {
    Looked(device(), Symptom::clean, 1);
    Looked(device(), Symptom::silence, 2);
  }
  EXPECT_THAT(Say()[0], ::testing::StartsWith("does not answer the request for " +
                                              record_.device->points[1].name + " ("));
  record_.points[1].value = 1.5;
  EXPECT_THAT(Say()[0], ::testing::HasSubstr("exchanges failed: ")) << "it was answered once";
}

TEST_F(DiagnoseTest, WhatHasAnsweredBeforeAndRefusesAllIsNotAskedForItsProfile) {
  device().queries = {{.first_point = 0, .points = 2, .refused = 3, .symptom = Symptom::refusal}};
  record_.points[0].value = 1.5;
  Ended(Outcome::unsupported, Symptom::refusal, 3, "",
        {.cause = "the module answers '?01' to #", .remedy = "does the profile fit the module?"});
  Looked(device(), Symptom::clean, 4);
  EXPECT_EQ(Say()[0],
            "it says 'the module answers '?01' to #' to 3 of 32 requests: it has answered before: "
            "another device, other settings or a fault: look at it, restart it");
  device().outcomes[static_cast<std::size_t>(Outcome::ok)] = 0;
  EXPECT_THAT(Say()[0], ::testing::HasSubstr("does the profile fit the module?"));
}

TEST_F(DiagnoseTest, ATextAroundNearlyAllRepliesComesFromInBetween) {
  Looked(device(), Symptom::text_beside, 3, {.cause = "'HB0001'"});
  Looked(device(), Symptom::clean, 20);
  EXPECT_THAT(SayOfLine(), ElementsAre("something on the line sends text by itself ('HB0001'): "
                                       "take it off this line, or switch its automatic output "
                                       "(heartbeat) off"));
  config_.lines[0].port = "tcp://10.0.0.7:4001";
  EXPECT_THAT(SayOfLine(), ElementsAre("text comes by itself ('HB0001'): a heartbeat or "
                                       "registration packet of the radio or serial server, or a "
                                       "device: switch it off"));
  Looked(device(), Symptom::text_beside, 32, {.cause = "'OK'"});
  EXPECT_THAT(SayOfLine(), IsEmpty());
  EXPECT_THAT(Say(), ElementsAre("the same text stands around its replies ('OK'): set the modem, "
                                 "radio or serial server in between to raw"));
  for (int i = 0; i < 32; ++i) {
    Looked(device(), Symptom::text_beside, 1, {.cause = i % 2 == 0 ? "'+IPD,7:'" : "'+IPD,13:'"});
  }
  EXPECT_THAT(Say()[0], ::testing::StartsWith("text stands around its replies ('+IPD,13:'): set"));
  const std::string server = std::exchange(config_.lines[0].port, "/dev/ttyUSB0");
  EXPECT_THAT(Say()[0], ::testing::HasSubstr("('+IPD,13:'): switch its automatic output off, or"));
  config_.lines[0].port = server;
  Looked(device(), Symptom::clean, 16);
  Looked(device(), Symptom::noise_behind, 16);
  EXPECT_THAT(Say()[0], ::testing::EndsWith("noise behind the serial server, or packets of its own "
                                            "(heartbeat): switch them off"));
  Looked(device(), Symptom::noise_behind, 32);
  EXPECT_THAT(Say()[0], ::testing::EndsWith("the modem, radio or serial server adds them: set it "
                                            "to raw"));
}

TEST_F(DiagnoseTest, WhatComesBesideGoodReplies) {
  Looked(device(), Symptom::noise_before, 4);
  EXPECT_THAT(Say(),
              ElementsAre("stray bytes stand before its replies in 4 of 32 exchanges: noise while "
                          "nobody drives the bus; check bias, termination and ground"));
  Looked(device(), Symptom::few_beside, 20, {.cause = "10 02 ... 10 03"});
  EXPECT_THAT(Say(), ElementsAre(::testing::StartsWith("stray bytes stand before its replies")))
      << "a packet stands around each";
  Looked(device(), Symptom::few_beside, 10, {.cause = "10 02 ... 10 03"});
  EXPECT_THAT(Say(), ElementsAre("the same bytes stand around its replies (10 02 ... 10 03): set "
                                 "the modem, radio or serial server in between to raw, or "
                                 "terminate the bus"));
  Looked(device(), Symptom::copies, 32);
  EXPECT_THAT(Say(), ElementsAre(::testing::StartsWith("its replies come twice in 32 of 32")));
  Looked(device(), Symptom::others_beside, 1);
  EXPECT_THAT(Say(),
              ElementsAre("a second reply with another content follows in 1 of 32 exchanges: "
                          "two devices have its address (2; unplug one), or another master "
                          "asks it (take it away)"))
      << "and others of theirs are alike";
  static constexpr config::Traits kCommon{.common_address = "0"};
  config::Device& its = config_.lines[0].devices[1];
  its.traits = &kCommon;
  const std::string address = std::exchange(its.address, "0");
  EXPECT_THAT(Say()[0],
              ::testing::HasSubstr("every device answers to address 0: give each its own"));
  its.traits = &SpabusProtocol().traits;
  its.address = address;
  Looked(device(), Symptom::clean, 30);
  Looked(device(), Symptom::master_beside, 2, {.cause = "another master", .remedy = "take it off"});
  EXPECT_THAT(Say(), IsEmpty()) << "that is the line's";
  EXPECT_THAT(SayOfLine(), ElementsAre("another master: take it off"));
}

TEST_F(DiagnoseTest, LateAnswersThatAreWaitedFor) {
  Ended(Outcome::ok, 20);
  device().patience = 244ms;
  device().lateness = 195'200us;
  device().late = 1;
  device().timing.reply = 300ms;
  EXPECT_THAT(Say(), IsEmpty()) << "once";
  device().late = 2;
  EXPECT_THAT(Say(),
              ElementsAre("late: its replies come up to 496 ms after the request, and timing.reply "
                          "is 300 ms: set timing: { reply: 550ms } at the device"));
  Looked(device(), Symptom::late, 1, {.time = 380ms});
  EXPECT_THAT(Say(), ElementsAre(::testing::HasSubstr("up to 380 ms")));
}

TEST_F(DiagnoseTest, RepliesThatAreAlwaysARequestLate) {
  device().behind = 15;
  EXPECT_THAT(Say(), IsEmpty());
  device().behind = 16;
  EXPECT_THAT(Say(), ElementsAre(::testing::StartsWith(
                         "its replies answer the request before, so that each request is sent")));
}

TEST_F(DiagnoseTest, SecondRepliesAreSaidHoweverSeldomAndForAnHour) {
  device().doubled = 1;
  device().last_doubled = kNow.instant - 50min;
  EXPECT_THAT(Say(), IsEmpty()) << "once is a repeat that met its reply";
  device().doubled = 2;
  EXPECT_THAT(Say(), ElementsAre(::testing::StartsWith(
                         "doubled: a second, different reply came behind one 2 times: ")));
  device().last_doubled = kNow.instant - 61min;
  EXPECT_THAT(Say(), IsEmpty());
}

TEST_F(DiagnoseTest, PointsThatAreNotGood) {
  record_.age_limits[static_cast<std::size_t>(config::Group::fast)] = {3s, 9s};
  record_.points[0].read_at = kNow.instant - 4s;
  record_.points[0].reported = Quality::good;
  record_.points[1].read_at = kNow.instant;
  record_.points[1].reported = Quality::bad_sensor_failure;
  EXPECT_THAT(Say(),
              ElementsAre("1 of 2 points are older than their max_age: its polls fail or come too "
                          "seldom",
                          "1 of 2 points have no good value (" + record_.device->points[1].name +
                              "): it sends no number for them (a decimal comma?); see trace"));
  const struct {
    std::string stands;
    std::string says;
    std::string remedy{};
  } rows[] = {
      {"", "it sends nothing for them: does the profile fit the device?"},
      {"0,52",
       "'0,52' is no number: set a decimal point at the device, or type: string in its profile"},
      {"-----", "'-----' stands for no measurement: look at its inputs and cards"},
      {"READY", "'READY' is no number: does the profile fit the device? type: string takes it"},
      {"'unit' says 'kg', which the description does not know",
       "'unit' says 'kg', which the description does not know: set that", "set that"},
  };
  for (const auto& row : rows) {
    Looked(device(), Symptom::no_number, 1, {.cause = row.stands, .remedy = row.remedy});
    EXPECT_THAT(Say()[1], ::testing::EndsWith("): " + row.says));
  }
  line_.port_since = kNow.wall - 1s;
  EXPECT_THAT(Say(), ElementsAre(::testing::HasSubstr("no good value")))
      << "its polls had no chance yet";
}

TEST_F(DiagnoseTest, AReader) {
  device().unasked = true;
  device().last_ok = kNow.instant - 12s;
  config_.lines[0].devices[1].max_age = 3s;
  record_.age_limits[static_cast<std::size_t>(config::Group::fast)] = {3s, 9s};
  for (PointRecord& point : record_.points) point.read_at = kNow.instant - 12s;
  EXPECT_THAT(Say(), ElementsAre("nothing has come for 12 s, and its max_age is shorter: check its "
                                 "power and its wire"));
  Looked(device(), Symptom::clean, 1, {.idle = 2s});
  Looked(device(), Symptom::clean, 15, {.idle = 20s});
  EXPECT_THAT(Say(), ElementsAre(::testing::StartsWith("nothing has come for 12 s")))
      << "others came sooner";
  Looked(device(), Symptom::clean, 16, {.idle = 10ms});
  Looked(device(), Symptom::clean, 16, {.idle = 20s});
  EXPECT_THAT(Say(), ElementsAre("comes every 20 s, and its max_age is shorter: raise its poll (or "
                                 "max_age) above that, or let it send more often"));
  device().last_ok = kNow.instant - 70s;
  EXPECT_THAT(Say(), ElementsAre(::testing::StartsWith("nothing has come for 70 s")))
      << "and not that this is normal";
  device().last_ok = kNow.instant - 12s;
  for (PointRecord& point : record_.points) point.read_at = kNow.instant;
  Looked(device(), Symptom::refusal, 4, {.cause = "no number in 'OL'", .remedy = "look at it"});
  EXPECT_THAT(
      Say(),
      ElementsAre(
          "no number in 'OL' (4 of its last 32 messages): look at it; or another device, or a "
          "header, stands between its messages: switch it off"));
  Looked(device(), Symptom::eighth_bit, 5);
  EXPECT_THAT(Say()[0],
              ::testing::StartsWith("5 of its last 32 messages are bad: they come damaged"));
  NeverAnswered();
  device().unasked = true;
  EXPECT_THAT(Say(), ElementsAre("has not spoken yet, and its values are old after 3s: check its "
                                 "power and wire, then bit rate and parity (9600 7E1) and its "
                                 "options"));
  config_.lines[0].devices[1].max_age = 18250 * 24h;
  EXPECT_THAT(Say(), ElementsAre(::testing::StartsWith("has not spoken yet: normal where nothing "
                                                       "has happened")));
  device().exchanges = 2;
  Looked(device(), Symptom::noise, 2);
  EXPECT_THAT(Say(), ElementsAre(::testing::StartsWith(
                                     "no message was good yet: bytes come, and no message: "
                                     "its bit rate or parity differs"),
                                 "feeder-1 answers on the same line"));
}

TEST_F(DiagnoseTest, AReaderThatAnswersNoCommand) {
  device().unasked = true;
  Looked(device(), Symptom::silence, 16);
  Minute().failed = 16;
  EXPECT_THAT(Say(),
              ElementsAre(::testing::StartsWith("speaks by itself, and does not answer its "
                                                "commands: check the wire that carries them")));
  Minute().answered = 3;
  EXPECT_THAT(Say()[0], ::testing::Not(::testing::HasSubstr("commands")));
}

TEST_F(DiagnoseTest, WhatAReaderHasNotReadYetIsNotMissing) {
  device().unasked = true;
  for (PointRecord& point : record_.points) {
    point.read_at = kNow.instant;
    point.reported = Quality(Quality::bad_sensor_failure, Reason::not_ready);
  }
  EXPECT_THAT(Say(), ::testing::Each(::testing::Not(::testing::HasSubstr("no good value"))));
}

TEST_F(DiagnoseTest, WhatTheDeviceSaysOfItsPoints) {
  const struct {
    Quality quality;
    std::string ends;
  } rows[] = {
      {Quality::bad, "it says that they are not valid, or sends another form: look at its sensors"},
      {Quality::uncertain,
       "it says itself that they are not certain (not stable): look at what it measures"},
      {{Quality::bad_sensor_failure, Reason::over_range},
       "look at the sensor, its wire and its range (a balance: its load)"},
      {{Quality::bad_sensor_failure, Reason::sentinel},
       "no measurement: look at what is connected to that input"},
  };
  for (const auto& row : rows) {
    record_.points[1].reported = row.quality;
    EXPECT_THAT(Say(), ElementsAre(::testing::EndsWith(row.ends)));
  }
  record_.points[0].reported = record_.points[1].reported;
  EXPECT_THAT(Say(), ElementsAre(::testing::EndsWith("look at what is behind the device")));
}

TEST_F(DiagnoseTest, PointsThatItIsSilentToAreNamed) {
  record_.points[1].reported = {Quality::bad_configuration, Reason::not_fitted};
  Looked(device(), Symptom::silence, 9);
  EXPECT_THAT(Say()[0], ::testing::StartsWith("does not answer the request for " +
                                              record_.device->points[1].name + " ("));
  Looked(device(), Symptom::refusal, 1, {.cause = "NACK 6"});
  EXPECT_THAT(Say()[0], ::testing::Not(::testing::StartsWith("does not answer")));
}

TEST_F(DiagnoseTest, NumbersThatNothingMeasuresAreInAnotherOrder) {
  record_.points[0].value = 3.879381e-35;
  record_.points[1].value = 0.0;
  config_.lines[0].devices[1].points[0].type = config::Type::float32;
  config_.lines[0].devices[1].points[1].type = config::Type::float64;
  const std::string name = record_.device->points[0].name;
  EXPECT_THAT(Say(), ElementsAre("1 of 2 numbers cannot be true (" + name +
                                 ": 3.88e-35): check the order of their bytes (order), their type "
                                 "and their register"));
  record_.points[0].value = -4.2e-9;
  EXPECT_THAT(Say(), ::testing::IsEmpty());
}

TEST_F(DiagnoseTest, TheOrderThatMakesAllNumbersUsualIsNamed) {
  config::Device& its = config_.lines[0].devices[1];
  its.options.Set("order", std::string("ABCD"));
  // 230.25 is 43 66 40 00, 50.02 is 42 48 14 7B; with the words swapped:
  for (const std::size_t i : {std::size_t{0}, std::size_t{1}}) {
    its.points[i].type = config::Type::float32;
    its.points[i].scale = 1;
    its.points[i].offset = 0;
    record_.points[i].value =
        static_cast<double>(std::bit_cast<float>(i == 0 ? 0x40004366U : 0x147B4248U));
  }
  EXPECT_THAT(Say()[0], ::testing::EndsWith(
                            ": their bytes come in another order: set order: CDAB at the device"));
  its.options.Set("order", std::string("BADC"));
  EXPECT_THAT(Say()[0], ::testing::EndsWith("and their register"));
}

TEST_F(DiagnoseTest, AClockThatIsNotSet) {
  device().lacks_time = true;
  EXPECT_THAT(Say(), ElementsAre(::testing::StartsWith("its clock is not set, as this machine's")));
}

TEST_F(DiagnoseTest, ASpeakerThatNeverSaysWhatIsWanted) {
  device().unasked = true;
  record_.points[0] = {};
  record_.age_limits[static_cast<std::size_t>(record_.device->points[0].group)].uncertain_after =
      6s;
  EXPECT_THAT(Say(), ElementsAre(::testing::HasSubstr("nothing that it sends has them")));
  device().missing = "no MDA comes: switch it on at the device";
  EXPECT_THAT(Say(), ElementsAre("1 of 2 points have no value yet (current): no MDA comes: switch "
                                 "it on at the device"));
}

TEST_F(DiagnoseTest, DoubtIsNotTheDevicesReport) {
  for (PointRecord& point : record_.points) {
    point.read_at = kNow.instant;
    point.reported = Quality::good;
  }
  record_.points[0].at_best = Quality::uncertain;
  EXPECT_THAT(Say(),
              ElementsAre("1 of 2 points are in doubt until they are read again: the port was "
                          "opened anew, the device was away, or a reply may have belonged to "
                          "another request"));
  record_.points[0].at_best = Quality::uncertain_last_usable;
  EXPECT_THAT(Say(),
              ElementsAre(::testing::HasSubstr("1 of 2 points are older than their max_age")));
}

TEST_F(DiagnoseTest, PointsWithoutAValueAlthoughTheDeviceAnswers) {
  record_.points[0] = {};
  Looked(device(), Symptom::refusal, 1, {.cause = "NACK 6"});
  EXPECT_THAT(Say(), ElementsAre("1 of 2 points have no value yet (current): it says 'NACK 6': "
                                 "does the profile fit the device and its options?"));
}

TEST_F(DiagnoseTest, DegradedWithoutAnotherSentenceSaysTheLastTrouble) {
  device().state = DeviceState::degraded;
  Ended(Outcome::corrupt, 1, "checksum 3A is not 74");
  EXPECT_THAT(
      Say(), ElementsAre(
                 "degraded: several of its last 32 exchanges failed; last: checksum 3A is not 74"));
}

}  // namespace
}  // namespace baudgate::control
