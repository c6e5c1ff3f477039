// Tests of the diagnosis of a device: occasional failures, late replies, no answer at all.
// SPDX-License-Identifier: Apache-2.0
#include "gateway/diagnosis/causes/diagnose.h"

#include <gtest/gtest.h>

#include <string>

#include "gateway/diagnosis/causes/evidence.h"
#include "gateway/diagnosis/causes/words.h"
#include "tests/gateway/diagnosis/causes/diagnose_fixture.h"

namespace baudgate::diagnosis {
namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;

TEST_F(DiagnoseTest, AHealthyDeviceIsNotReported) {
  EXPECT_THAT(Say(), IsEmpty());
  EXPECT_THAT(SayOfLine(), IsEmpty());
  Ended(Outcome::corrupt, 1);
  Ended(Outcome::ok, 1);
  EXPECT_THAT(Say(), IsEmpty()) << "one of a thousand is no news";
}

TEST_F(DiagnoseTest, OccasionalFailuresNameTheirCause) {
  const struct {
    Outcome outcome;
    std::uint32_t count;
    std::string reason;
    std::string sentence;
    std::string remedy{};
  } rows[] = {
      {Outcome::corrupt, 20, "checksum",
       "20 of 32 exchanges failed: its replies come damaged. Check wire and plug at its end, and "
       "check whether two devices have address 2"},
      {Outcome::corrupt, 30, "checksum",
       "30 of 32 exchanges failed: its replies come damaged. Check whether two devices have "
       "address 2, and check the wire at its end"},
      {Outcome::no_reply, 2, "",
       "2 of 32 exchanges failed: now and then a request gets no answer. Check for noise, and for "
       "a bad wire or plug at its end"},
      {Outcome::busy, 32, "exception 06",
       "it answers 'exception 06' to 32 of 32 requests. End its programming, local or test mode, "
       "or restart it"},
      {Outcome::busy, 7, "function 03: exception 06, device busy",
       "it answers 'function 03: exception 06, device busy' to 7 of 32 requests. Poll it less "
       "often (poll)"},
      {Outcome::refused, 20, "exception 04, device failure",
       "it answers 'exception 04, device failure' to 20 of 32 requests. Look at it", "look at it"},
      {Outcome::unsupported, 64, "",
       "it answers 'unsupported' to 32 of 32 requests. Check that the profile fits the device and "
       "its options"},
  };
  const bus::DeviceStatus well = device();
  for (const auto& row : rows) {
    device() = well;
    Ended(row.outcome, SymptomOf(row.outcome), row.count, row.reason,
          {.cause = row.reason, .remedy = row.remedy});
    EXPECT_THAT(Say(), ElementsAre(row.sentence));
  }
}

TEST_F(DiagnoseTest, RareLossesBeyondTheLatestExchangesAreReported) {
  for (int i = 0; i < 5; ++i) {
    Ended(Outcome::no_reply, 1);
    Ended(Outcome::ok, 19);
  }
  Ended(Outcome::ok, 20);
  EXPECT_THAT(Say(), IsEmpty()) << "the exchanges of the fixture are many";
  device().failures = device().spoilt = {};
  device().findings = {};
  for (const int behind : {9, 30, 12, 25, 14, 29}) {
    Ended(Outcome::no_reply, 1);
    Ended(Outcome::ok, behind);
  }
  Ended(Outcome::ok, 15);
  EXPECT_THAT(Say(), ElementsAre("6 of 140 exchanges failed: now and then a request gets no "
                                 "answer. Check for noise, and for a bad wire or plug at its end"));
  Looked(device(), Symptom::damaged, 1);
  EXPECT_THAT(Say()[0], ::testing::HasSubstr("now and then a request gets no answer"))
      << "the largest class of failures";
}

TEST_F(DiagnoseTest, DevicesThatFailAtTheSameTimeNameEachOther) {
  const struct {
    Outcome outcome;
    Symptom symptom;
    std::string before;
    std::string behind;
  } rows[] = {
      {Outcome::no_reply, Symptom::silence,
       "it stops answering for about 4.0 s every 16 s, at the same time as ",
       ". Check the supply and the branch of the line that these devices share"},
      {Outcome::corrupt, Symptom::damaged,
       "its replies come damaged at the same times as those of ",
       ". Check what these devices share: contacts, cable, termination and ground"},
  };
  const bus::DeviceStatus well = device();
  const bus::DeviceStatus beside = neighbour_.status;
  for (const auto& row : rows) {
    device() = well;
    neighbour_.status = beside;
    for (int i = 0; i < 4; ++i) {
      const Instant begin = looked_;
      Ended(row.outcome, 4);
      Ended(Outcome::ok, 12);
      looked_ = begin;
      Looked(neighbour_.status, row.symptom, 3);
      Looked(neighbour_.status, Symptom::clean, 13);
    }
    EXPECT_THAT(Say()[0], ::testing::EndsWith(row.before + neighbour_.device->name + row.behind));
  }
}

/// The neighbour is silent at the same times, so the line is idle before each request. An idle line
/// before a failure is therefore no sign of a sleeping device.
TEST_F(DiagnoseTest, DevicesAbsentAtTheSameTimeAreNotTakenForSleeping) {
  for (int i = 0; i < 4; ++i) {
    const Instant begin = looked_;
    for (bus::DeviceStatus* status : {&device(), &neighbour_.status}) {
      looked_ = begin;
      Looked(*status, Symptom::silence, 3, {.idle = 600ms});
      Looked(*status, Symptom::clean, 13, {.idle = 50ms});
    }
  }
  EXPECT_THAT(Say()[0], ::testing::HasSubstr(", at the same time as "));
}

TEST_F(DiagnoseTest, AnEndedOutageIsSoonNoLongerReported) {
  Ended(Outcome::no_reply, 2000);
  Ended(Outcome::ok, 28);
  EXPECT_THAT(Say(), ElementsAre(::testing::StartsWith("4 of 32 exchanges failed: ")));
  Ended(Outcome::ok, 3);
  EXPECT_THAT(Say(), IsEmpty());
}

TEST_F(DiagnoseTest, ADeviceThatAnswersInPlaceOfAnotherIsReported) {
  device().trouble = "meter 2 answers in place of 1";
  record_.override_quality = Quality{Quality::bad, Reason::swapped};
  EXPECT_THAT(Say(), ElementsAre("no value is good: meter 2 answers in place of 1"));
  Looked(device(), Symptom::damaged, 3);
  EXPECT_THAT(Say(), ElementsAre("no value is good: meter 2 answers in place of 1. Check whether "
                                 "two devices have address 2"));
  neighbour_.override_quality = record_.override_quality;
  EXPECT_THAT(Say(),
              ElementsAre("no value is good: meter 2 answers in place of 1. Check whether it and " +
                          neighbour_.device->name + " have each other's address"));
}

TEST_F(DiagnoseTest, OutagesOfTheLastHourAreCounted) {
  Minute().outages = 1;
  Minute().up = 59min;
  Minute().down = 10s;
  EXPECT_THAT(Say(), IsEmpty()) << "a restart is no news";
  Minute().outages = 9;
  Minute().down = 10min;
  EXPECT_THAT(Say(), ElementsAre("9 outages in the last hour, and it answered 86 % of the time. "
                                 "Check its power and its wire"));
  line_.exchanges = 100;
  line_.echoed = 0xFFFFFFFF;
  EXPECT_THAT(Say(), IsEmpty()) << "the line's sentence tells why";
  line_.echoed = 0;
  device().hour.At(status::kNow.instant) = {};
  device().hour.At(status::kNow.instant - 61min).outages = 9;
  EXPECT_THAT(Say(), IsEmpty());
}

TEST_F(DiagnoseTest, ASingleUnansweredRequestIsNamed) {
  device().queries = {{.first_point = 0, .points = 1},
                      {.first_point = 1, .points = 3, .in_vain = 5, .symptom = Symptom::silence}};
  const std::string name = record_.device->points[1].name;
  EXPECT_THAT(Say(),
              ElementsAre("does not answer the request for " + name + " and 2 more (" +
                          record_.device->points[1].read +
                          "), but answers other requests. Take these points out of the profile"));
  Looked(device(), Symptom::silence, 1, {.ended = true});
  EXPECT_THAT(Say(), ElementsAre(::testing::StartsWith("ends the connection at the request for " +
                                                       name + " and 2 more (")));
  device().findings = {};
  Looked(device(), Symptom::clean, 24);
  device().queries[1].symptom = Symptom::damaged;
  Looked(device(), Symptom::damaged, 8);
  EXPECT_THAT(Say(), ElementsAre(::testing::StartsWith("only the replies for " + name +
                                                       " and 2 more come damaged. ")));
  device().queries[0].failures = 0b1010;
  EXPECT_THAT(Say(), ElementsAre(::testing::StartsWith("8 of 32 exchanges failed: ")))
      << "others fail now and then as well";
  device().queries[0].failures = 0;
  device().findings = {};
  Looked(device(), Symptom::clean, 9);
  device().queries[0] = device().queries[1];
  EXPECT_THAT(Say(), IsEmpty()) << "it answers none";
}

TEST_F(DiagnoseTest, UnconfirmedReadingsAreReportedAsDamage) {
  device().exchanges = 100;
  device().unconfirmed = 4;
  EXPECT_THAT(Say(), ElementsAre("4 of its readings changed when they were read again, so replies "
                                 "may be damaged although they look whole. Look for noise, and "
                                 "switch a checksum on at the device and in the configuration"));
  device().rechecks = 13;
  EXPECT_THAT(Say(), IsEmpty()) << "most jumps were real";
  device().rechecks = 12;
  device().exchanges = 101;
  EXPECT_THAT(Say(), IsEmpty());
}

TEST_F(DiagnoseTest, ARequestWithAnOddReplyIsNotReportedAsSilent) {
  for (bus::PointRecord& point : record_.points) point.reported = Quality::bad_waiting;
  device().queries = {{.first_point = 0, .points = 1},
                      {.first_point = 1, .points = 1, .in_vain = 5, .symptom = Symptom::odd}};
  device().last_reason = "6 values came where 8 channels are configured";
  Looked(device(), Symptom::clean, 32);
  EXPECT_THAT(Say()[0],
              ::testing::StartsWith(
                  "only the request for " + record_.device->points[1].name +
                  " fails: its reply does not fit the request (6 values came where 8 channels"));
}

TEST_F(DiagnoseTest, LossesAtAllPollsAreNoSilentPoints) {
  record_.points[1].reported = Quality::bad_waiting;
  device().queries = {{.first_point = 0, .points = 1},
                      {.first_point = 1, .points = 1, .in_vain = 9, .symptom = Symptom::silence}};
  for (int i = 0; i < 11; ++i) {
    Looked(device(), Symptom::silence, 2);
    Looked(device(), Symptom::clean, 1);
  }
  EXPECT_THAT(Say()[0], ::testing::StartsWith("does not answer the request for "));
  device().queries[0].failures = 0xFF;
  EXPECT_THAT(Say()[0], ::testing::HasSubstr("now and then a request gets no answer"));
}

TEST_F(DiagnoseTest, ADeviceThatAnswersOnlyProbesIsReported) {
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

TEST_F(DiagnoseTest, ADeviceThatBeginsToRefuseIsNotAskedForItsProfile) {
  device().queries = {{.first_point = 0, .points = 2, .refused = 3, .symptom = Symptom::refusal}};
  record_.points[0].value = 1.5;
  Ended(Outcome::unsupported, Symptom::refusal, 3, "",
        {.cause = "the module answers '?01' to #",
         .remedy = "check that the profile and its channels fit the module"});
  Looked(device(), Symptom::clean, 4);
  EXPECT_EQ(Say()[0],
            "it answers 'the module answers '?01' to #' to 3 of 32 requests. It has answered "
            "before: check whether the device or its settings were changed, or restart it");
  device().outcomes[static_cast<std::size_t>(Outcome::ok)] = 0;
  EXPECT_THAT(Say()[0], ::testing::HasSubstr("Check that the profile and its channels fit"));
}

TEST_F(DiagnoseTest, ATextAroundNearlyAllRepliesIsBlamedOnTheConverter) {
  Looked(device(), Symptom::text_beside, 3, {.cause = "'HB0001'"});
  Looked(device(), Symptom::clean, 20);
  EXPECT_THAT(SayOfLine(),
              ElementsAre("text comes unasked on the line ('HB0001'). Take the device that sends "
                          "it off this line, or switch its automatic output (heartbeat) off"));
  config_.lines[0].port = "tcp://10.0.0.7:4001";
  EXPECT_THAT(
      SayOfLine(),
      ElementsAre("text comes unasked ('HB0001'). Switch off the heartbeat or registration "
                  "packet of the radio or serial server, or the automatic output of a device"));
  Looked(device(), Symptom::text_beside, 32, {.cause = "'OK'"});
  EXPECT_THAT(SayOfLine(), IsEmpty());
  EXPECT_THAT(Say(), ElementsAre("the same text comes around its replies ('OK'). Set the modem, "
                                 "radio or serial server in between to raw"));
  for (int i = 0; i < 32; ++i) {
    Looked(device(), Symptom::text_beside, 1, {.cause = i % 2 == 0 ? "'+IPD,7:'" : "'+IPD,13:'"});
  }
  EXPECT_THAT(Say()[0], ::testing::StartsWith("text comes around its replies ('+IPD,13:'). Set"));
  const std::string server = std::exchange(config_.lines[0].port, "/dev/ttyUSB0");
  EXPECT_THAT(Say()[0], ::testing::HasSubstr("('+IPD,13:'). Switch its automatic output off, or"));
  config_.lines[0].port = server;
  Looked(device(), Symptom::clean, 16);
  Looked(device(), Symptom::noise_behind, 16);
  EXPECT_THAT(Say()[0],
              ::testing::EndsWith(
                  "Look for noise behind the serial server, and switch off its heartbeat packets"));
  Looked(device(), Symptom::noise_behind, 32);
  EXPECT_THAT(Say()[0],
              ::testing::EndsWith("The modem, radio or serial server adds them: set it to raw"));
}

TEST_F(DiagnoseTest, BytesBesideGoodRepliesAreReported) {
  Looked(device(), Symptom::noise_before, 4);
  EXPECT_THAT(Say(),
              ElementsAre("stray bytes come before its replies in 4 of 32 exchanges. Noise comes "
                          "while no device drives the bus: check bias, termination and ground"));
  Looked(device(), Symptom::few_beside, 20, {.cause = "10 02 ... 10 03"});
  EXPECT_THAT(Say(), ElementsAre(::testing::StartsWith("stray bytes come before its replies")))
      << "a packet stands around each";
  Looked(device(), Symptom::few_beside, 10, {.cause = "10 02 ... 10 03"});
  EXPECT_THAT(Say(),
              ElementsAre("the same bytes come around its replies (10 02 ... 10 03). Set the "
                          "modem, radio or serial server in between to raw, or terminate the bus"));
  Looked(device(), Symptom::copies, 32);
  EXPECT_THAT(Say(), ElementsAre(::testing::StartsWith("its replies come twice in 32 of 32")));
  Looked(device(), Symptom::others_beside, 1);
  EXPECT_THAT(
      Say(),
      ElementsAre("a second reply with another content follows in 1 of 32 exchanges. Check whether "
                  "two devices have address 2, or remove another master from the line"))
      << "and others of theirs are alike";
  static constexpr config::Traits kCommon{.common_address = "0"};
  config::Device& its = config_.lines[0].devices[1];
  its.traits = &kCommon;
  const std::string address = std::exchange(its.address, "0");
  EXPECT_THAT(Say()[0], ::testing::HasSubstr("every device answers to address 0"));
  its.traits = &protocols::SpabusProtocol().traits;
  its.address = address;
  Looked(device(), Symptom::clean, 30);
  Looked(device(), Symptom::master_beside, 2, {.cause = "another master", .remedy = "take it off"});
  EXPECT_THAT(Say(), IsEmpty()) << "that is the line's";
  EXPECT_THAT(SayOfLine(), ElementsAre("another master. Take it off"));
}

TEST_F(DiagnoseTest, AwaitedLateAnswersSuggestALongerReplyTime) {
  Ended(Outcome::ok, 20);
  device().patience = 244ms;
  device().lateness = 195'200us;
  device().late = 1;
  device().timing.reply = 300ms;
  EXPECT_THAT(Say(), IsEmpty()) << "once";
  device().late = 2;
  EXPECT_THAT(
      Say(), ElementsAre("late: its replies come up to 496 ms after the request (timing.reply: 300 "
                         "ms). Set timing: { reply: 550ms } in the configuration"));
  Looked(device(), Symptom::late, 1, {.time = 380ms});
  EXPECT_THAT(Say(), ElementsAre(::testing::HasSubstr("up to 380 ms")));
}

TEST_F(DiagnoseTest, RepliesThatLagByOneRequestAreReported) {
  device().behind = 15;
  EXPECT_THAT(Say(), IsEmpty());
  device().behind = 16;
  EXPECT_THAT(
      Say(),
      ElementsAre(::testing::StartsWith(
          "its replies answer the previous request, so the gateway sends each request twice")));
}

TEST_F(DiagnoseTest, RareSecondRepliesAreReportedForAnHour) {
  device().doubled = 1;
  device().last_doubled = status::kNow.instant - 50min;
  EXPECT_THAT(Say(), IsEmpty()) << "once is a repeat that met its reply";
  device().doubled = 2;
  EXPECT_THAT(Say(), ElementsAre(::testing::StartsWith(
                         "a second, different reply to one request came 2 times. ")));
  device().last_doubled = status::kNow.instant - 61min;
  EXPECT_THAT(Say(), IsEmpty());
}

TEST_F(DiagnoseTest, AnUnsetClockIsReported) {
  device().lacks_time = true;
  EXPECT_THAT(Say(), ElementsAre(::testing::StartsWith(
                         "its clock is not set, because the clock of this machine")));
}

TEST_F(DiagnoseTest, ADegradedDeviceReportsItsLastTrouble) {
  device().state = bus::DeviceState::degraded;
  Ended(Outcome::corrupt, 1, "checksum 3A is not 74");
  EXPECT_THAT(Say(), ElementsAre("degraded: several of its last 32 exchanges failed; last failure: "
                                 "checksum 3A is not 74"));
}

TEST(Reason, IsShortened) {
  const struct {
    std::string reason;
    std::string text;
  } rows[] = {
      {"checksum", "checksum"},
      {"exception 0B; it is silent", "exception 0B"},
      {"the module answers '?01' to #: it does not know this command, or the channel is disabled",
       "the module answers '?01' to #"},
      {"no number in 'OL'", "no number in 'OL'"},
      {"reply '!01+01.500+02.500+03.500C4\\r' has another form",
       "reply '!01+01.500+0...' has another form"},
      {"it answers 'J\\x00\\x00\\x00\\n8.0.36'", "it answers 'J\\x00\\x00...'"},
  };
  for (const auto& row : rows) EXPECT_EQ(Shortened(row.reason), row.text);
}

TEST_F(DiagnoseTest, AnAbsentDeviceReportsSinceWhenWhyAndItsNoticeBound) {
  line_.notice_bound = 9s;
  device().state = bus::DeviceState::offline;
  device().last_ok = status::kNow.instant - 12min;
  Ended(Outcome::no_reply, 34);
  EXPECT_THAT(Say(), ElementsAre("offline for 12 min: not a byte comes any more. Check its power "
                                 "and its wire, and whether its settings were changed",
                                 "feeder-1 answers on the same line",
                                 "the gateway notices its return within 9.0 s"));
  NeverAnswered();
  EXPECT_THAT(Say(), ElementsAre("not asked yet"));
  Ended(Outcome::no_reply, 34);
  EXPECT_THAT(
      Say(),
      ElementsAre("has never answered: not a byte came. Check its power and wire, then its address "
                  "(2), bit rate, parity and protocol (9600 7E1, spabus)",
                  "feeder-1 answers on the same line"));
}

TEST_F(DiagnoseTest, ModemTextBeforeTheSilenceIsReportedAsItsCause) {
  const Finding said{.cause = "'NO CARRIER'", .remedy = "dial again"};
  for (const bool answered_since : {false, true}) {
    Looked(device(), Symptom::text_beside, 1, said);
    if (answered_since) Looked(device(), Symptom::clean, 1);
    device().state = bus::DeviceState::offline;
    device().last_ok = status::kNow.instant - 12min;
    Ended(Outcome::no_reply, 34);
    EXPECT_EQ(Say()[0],
              answered_since
                  ? "offline for 12 min: not a byte comes any more. Check its power and its wire, "
                    "and whether its settings were changed"
                  : "offline for 12 min: 'NO CARRIER' came, and nothing since. Dial again");
  }
}

TEST_F(DiagnoseTest, DevicesFellTogetherOnlyIfTheyFellAtTheSameTime) {
  device().state = neighbour_.status.state = bus::DeviceState::offline;
  device().last_ok = status::kNow.instant - 12min;
  for (const bool together : {true, false}) {
    neighbour_.status.last_ok = *device().last_ok + (together ? 1s : 1min);
    const bus::DeviceRecord both[] = {neighbour_, record_};
    EXPECT_EQ(Gather(line_, record_, both, status::kNow).fell, together ? "feeder-1" : "");
  }
}

TEST_F(DiagnoseTest, AReturningDeviceIsNotReported) {
  device().state = bus::DeviceState::offline;
  device().last_ok = status::kNow.instant - 300ms;
  Ended(Outcome::ok, 2);
  EXPECT_THAT(Say(), ::testing::IsEmpty());
  neighbour_.status.state = bus::DeviceState::offline;
  EXPECT_THAT(Say(), ::testing::IsEmpty()) << "nor is its line, whose port was lent";
  EXPECT_THAT(SayOfLine(), ::testing::IsEmpty());
}

TEST_F(DiagnoseTest, AfterAnOutageOfThePortADeviceIsNotBlamed) {
  device().state = bus::DeviceState::offline;
  Ended(Outcome::line_down, 1, "the port is closed");
  EXPECT_THAT(Say(), ElementsAre("not asked since the port was opened"));
  NeverAnswered();
  Ended(Outcome::no_reply, 5);
  device().last_outcome = Outcome::line_down;
  EXPECT_THAT(Say(), ::testing::Contains(::testing::HasSubstr("not a byte came")))
      << "before the port was opened anew as well";
}

TEST_F(DiagnoseTest, ADisabledDeviceIsReported) {
  device().state = bus::DeviceState::disabled;
  EXPECT_THAT(
      Say(),
      ElementsAre("disabled at run time. Run 'baudgate enable bay-1.feeder-2' to use it again"));
  config_.lines[0].devices[1].enabled = false;
  EXPECT_THAT(Say(), ElementsAre("disabled in the configuration (enabled: false)"));
}

}  // namespace
}  // namespace baudgate::diagnosis
