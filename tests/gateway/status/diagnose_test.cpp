// From counters and states to sentences, row by row.
// SPDX-License-Identifier: Apache-2.0
#include "gateway/status/diagnose.h"

#include <gmock/gmock.h>

#include "tests/gateway/status/two_lines.h"

namespace baudgate::control {
namespace {

using ::testing::ElementsAre;
using ::testing::ElementsAreArray;
using ::testing::IsEmpty;

class DiagnoseTest : public testing::Test {
 protected:
  DiagnoseTest() {
    record_.line = &config_.lines[0];
    record_.device = &config_.lines[0].devices[1];
    record_.points.resize(2);
    neighbour_.line = record_.line;
    neighbour_.device = &config_.lines[0].devices[0];
    neighbour_.status.state = DeviceState::online;
    line_.port = LineStatus::Port::open;
    Ended(Outcome::ok, 1000);
    device().state = DeviceState::online;
    device().last_ok = kNow.instant - 1s;
  }

  DeviceStatus& device() { return record_.status; }
  void Ended(Outcome outcome, std::uint32_t count, const std::string& reason = {}) {
    device().exchanges += count;
    device().outcomes[static_cast<std::size_t>(outcome)] += count;
    device().last_outcome = outcome;
    device().last_reason = reason;
    for (std::uint32_t i = 0; i < count; ++i) device().recent.Add(outcome);
  }
  void NeverAnswered() {
    device() = {};
    device().state = DeviceState::never_seen;
  }
  std::vector<std::string> Say() const {
    const DeviceRecord both[] = {neighbour_, record_};
    return Diagnose(line_, record_, LookAt(both, kNow, kStarted), kNow, kStarted);
  }
  std::vector<std::string> SayOfLine() const {
    const DeviceRecord both[] = {neighbour_, record_};
    return SayOfLine(LookAt(both, kNow, kStarted));
  }
  std::vector<std::string> SayOfLine(const LineDevices& devices) const {
    return DiagnoseLine(config_.lines[0], line_, devices, kNow);
  }

  config::Config config_ = TwoLines();
  LineStatus line_;
  DeviceRecord record_;
  DeviceRecord neighbour_;
};

TEST_F(DiagnoseTest, AHealthyDeviceIsNotTalkedAbout) {
  EXPECT_THAT(Say(), IsEmpty());
  EXPECT_THAT(SayOfLine(), IsEmpty());
  Ended(Outcome::no_reply, 1);
  Ended(Outcome::corrupt, 1);
  Ended(Outcome::ok, 1);
  EXPECT_THAT(Say(), IsEmpty()) << "one of a thousand is no news";
}

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
       "its answers can not be read: check parity, data bits and checksum (address 2, 9600 7E1), "
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
                                 "9.0 s; late: bytes came 80 ms after the exchange had ended, 17 "
                                 "times: raise its timing.reply by more than 80 ms"));
}

TEST_F(DiagnoseTest, OfBytesAfterTheEndTheTrueCauseIsSaid) {
  device().state = DeviceState::offline;
  device().last_ok = kNow.instant - 12min;
  device().late = 3;
  Ended(Outcome::partial, 34);
  EXPECT_THAT(Say()[0], testing::EndsWith("its answers stop half-way: raise its timing.gap, then "
                                          "check wiring"));
  Ended(Outcome::no_reply, 34);
  EXPECT_THAT(Say()[0], testing::HasSubstr("check power")) << "late a few times, long ago";
  device().state = DeviceState::online;
  device().late = 17;
  Ended(Outcome::partial, 4);
  EXPECT_THAT(Say(),
              ElementsAre(testing::StartsWith("partial in "), testing::StartsWith("late: ")));
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
  EXPECT_THAT(Say()[0], testing::StartsWith(
                            "has never answered: corrupt; nothing good came in 35 exchanges;"));
}

TEST_F(DiagnoseTest, AfterAnOutageOfThePortADeviceIsNotBlamed) {
  device().state = DeviceState::offline;
  Ended(Outcome::line_down, 1, "the port is closed");
  EXPECT_THAT(Say(), ElementsAre("not asked since the port was opened"));
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
       "unexpected in 2 of its last 64 exchanges: frames of another address or shape: a second "
       "master, two devices with one address, or answers that come too late; look at 'baudgate "
       "trace bay-1'"},
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
  EXPECT_THAT(Say(), ElementsAre(testing::StartsWith("corrupt in 1 of its last 64 exchanges: ")));
}

TEST_F(DiagnoseTest, AnOutageIsNotHeldAgainstADeviceForEver) {
  Ended(Outcome::no_reply, 2000);
  Ended(Outcome::ok, 60);
  EXPECT_THAT(Say(), ElementsAre(testing::StartsWith("no_reply in 4 of its last 64 exchanges: it "
                                                     "was off for a moment or")));
  Ended(Outcome::ok, 4);
  EXPECT_THAT(Say(), IsEmpty());
}

TEST_F(DiagnoseTest, LateAnswersAreNotMissedRequests) {
  Ended(Outcome::no_reply, 20);
  device().late = 17;
  device().lateness = 79'200us;
  EXPECT_THAT(Say(), ElementsAre("late: bytes came 80 ms after the exchange had ended, 17 times: "
                                 "raise its timing.reply by more than 80 ms"));
}

TEST_F(DiagnoseTest, SecondRepliesAreSaidHoweverSeldom) {
  device().doubled = 1;
  EXPECT_THAT(Say(), ElementsAre(testing::StartsWith(
                         "doubled: a second, different reply came behind one once: ")));
}

TEST_F(DiagnoseTest, MissedPeriods) {
  device().missed = 100;  // of the 10,800 in three hours: not one in a hundred
  EXPECT_THAT(Say(), IsEmpty());
  device().missed = 1296;
  EXPECT_THAT(Say(), ElementsAre("missed 12 % of its periods since the start (1296): a round takes "
                                 "longer than its period, or failures took the time; if the count "
                                 "grows, raise poll, ask for fewer points, or raise the bit rate"));
  EXPECT_THAT(SayOfLine(), IsEmpty());
  line_.use = 0.98;
  EXPECT_THAT(Say(), ElementsAre("missed 12 % of its periods since the start (1296): the line is "
                                 "full (use 98 %); raise poll, ask for fewer points, or raise the "
                                 "bit rate"));
  EXPECT_THAT(SayOfLine(), ElementsAre("full (use 98 %): more is asked than fits: raise poll, ask "
                                       "for fewer points, or raise the bit rate"));
  device().missed = 0;
  EXPECT_THAT(SayOfLine(), IsEmpty()) << "a line that is full and misses nothing is well used";
}

/// 1296 periods of feeder-2 are missed on a full line, and feeder-1 beside it is as each test says.
class MissedBesideTest : public DiagnoseTest {
 protected:
  MissedBesideTest() {
    line_.use = 0.96;
    device().missed = 1296;
    device().busy = 40s;
    for (int i = 0; i < 1000; ++i) device().round_trips.Add(38ms);
    neighbour_.status.exchanges = 1000;
  }
  void NeighbourEnds(Outcome outcome, int count) {
    for (int i = 0; i < count; ++i) neighbour_.status.recent.Add(outcome);
  }
};

TEST_F(MissedBesideTest, ANeighbourThatFailsIsNamedWithItsPartOfTheTime) {
  NeighbourEnds(Outcome::ok, 24);
  NeighbourEnds(Outcome::no_reply, 40);
  for (int i = 0; i < 100; ++i) neighbour_.status.round_trips.Add(50ms);
  neighbour_.status.busy = 60s;  // 55 of them in vain
  const std::string cause =
      "feeder-1 has taken 55 % of the line's time with exchanges that fail (40 of its last 64): "
      "mend that first";
  EXPECT_THAT(Say(), ElementsAre("missed 12 % of its periods since the start (1296): " + cause));
  EXPECT_THAT(SayOfLine(), ElementsAre("full (use 96 %): " + cause));
}

TEST_F(MissedBesideTest, ANeighbourThatBeganToFailLatelyIsNamedWithoutAPart) {
  NeighbourEnds(Outcome::ok, 54);
  NeighbourEnds(Outcome::corrupt, 10);
  neighbour_.status.busy = 8s;
  EXPECT_THAT(Say(), ElementsAre("missed 12 % of its periods since the start (1296): feeder-1 "
                                 "fails in 10 of its last 64 exchanges: mend that first, then "
                                 "raise poll, ask for fewer points, or raise the bit rate"));
}

TEST_F(MissedBesideTest, AnAbsentNeighbourIsNamedFromANotablePartOn) {
  neighbour_.status.state = DeviceState::offline;
  neighbour_.status.busy = 4s;
  EXPECT_THAT(Say()[0], testing::HasSubstr("the line is full"));
  neighbour_.status.busy = 10s;
  EXPECT_THAT(Say()[0], testing::EndsWith("(1296): feeder-1 does not answer and has taken 20 % of "
                                          "the line's time: mend that first, then raise poll, ask "
                                          "for fewer points, or raise the bit rate"));
  neighbour_.status.busy = 60s;
  EXPECT_THAT(Say()[0], testing::EndsWith("(1296): feeder-1 does not answer and has taken 60 % of "
                                          "the line's time: mend that first"));
  neighbour_.status.state = DeviceState::disabled;
  EXPECT_THAT(Say()[0], testing::HasSubstr("the line is full"));
}

TEST_F(MissedBesideTest, OneThatAnswersNowAndThenIsNamedBeforeAnAbsentOne) {
  DeviceRecord failing = neighbour_;
  for (int i = 0; i < 32; ++i) failing.status.recent.Add(Outcome::no_reply);
  neighbour_.status.state = DeviceState::offline;
  neighbour_.status.busy = 60s;
  const DeviceRecord orders[][2] = {{failing, neighbour_}, {neighbour_, failing}};
  for (const auto& records : orders) {
    const LineDevices seen = LookAt(records, kNow, kStarted);
    ASSERT_NE(seen.wasteful, nullptr);
    EXPECT_EQ(seen.wasteful->status.state, DeviceState::online);
  }
}

TEST_F(MissedBesideTest, ADeviceThatFailsItselfIsIt) {
  device().busy = 100s;
  Ended(Outcome::partial, 64);
  EXPECT_THAT(Say(), ElementsAre(testing::StartsWith("partial in "),
                                 testing::EndsWith("(1296): it has taken 62 % of the line's time "
                                                   "with exchanges that fail (64 of its last 64): "
                                                   "mend that first")));
}

TEST_F(MissedBesideTest, ANeighbourThatHasRecoveredIsNotNamed) {
  NeighbourEnds(Outcome::no_reply, 64);
  NeighbourEnds(Outcome::ok, 57);
  neighbour_.status.busy = 60s;
  EXPECT_THAT(Say()[0], testing::HasSubstr("the line is full"));
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
  EXPECT_THAT(Say(), ElementsAre(testing::HasSubstr("1 of 2 points are older than their max_age")));
}

TEST_F(DiagnoseTest, DegradedWithoutAnotherSentenceSaysTheLastTrouble) {
  device().state = DeviceState::degraded;
  Ended(Outcome::corrupt, 1, "checksum 3A is not 74");
  EXPECT_THAT(Say(), ElementsAre("degraded: several of its last 32 exchanges failed; last: "
                                 "checksum 3A is not 74"));
}

TEST_F(DiagnoseTest, DisabledDevices) {
  device().state = DeviceState::disabled;
  EXPECT_THAT(Say(), ElementsAre("taken out of use at run time; 'baudgate enable bay-1.feeder-2' "
                                 "brings it back"));
  config_.lines[0].devices[1].enabled = false;
  EXPECT_THAT(Say(), ElementsAre("disabled in the configuration (enabled: false)"));
}

TEST_F(DiagnoseTest, BehindAClosedPortTheLineSpeaks) {
  device().state = DeviceState::offline;
  line_.port = LineStatus::Port::closed;
  line_.port_text = "/dev/ttyUSB0: No such file or directory";
  line_.port_since = kNow.wall - 3min;
  EXPECT_THAT(Say(), IsEmpty());
  EXPECT_THAT(SayOfLine(), ElementsAre("port closed for 3 min: /dev/ttyUSB0: No such file or "
                                       "directory; it is tried again until it works"));
  line_.port = LineStatus::Port::released;
  line_.released_until = kNow.wall + 10min;
  EXPECT_THAT(Say(), IsEmpty());
  EXPECT_THAT(SayOfLine(), ElementsAre("released: the port is lent until 14:23:20 UTC; 'baudgate "
                                       "release bay-1 --end' takes it back"));
}

TEST_F(DiagnoseTest, TroubleOfALine) {
  const struct {
    std::function<void(LineStatus&)> trouble;
    std::string sentence;
  } rows[] = {
      {[](LineStatus& line) { line.echoes = 12; },
       "the request itself came back 12 times: set 'echo: strip' at the line"},
      {[](LineStatus& line) { line.collisions = 1; },
       "the echo was missing or different once: two talkers at once, or a bus that does not echo "
       "(set 'echo: off')"},
      {[](LineStatus& line) { line.parity_errors = 34, line.framing_errors = 3; },
       "34 parity and 3 framing errors since the port was opened: bit rate, parity or data bits "
       "differ (9600 7E1), or noise"},
      {[](LineStatus& line) { line.overruns = 5; },
       "the driver lost bytes 5 times: the machine is too busy, or the adapter needs flow control "
       "(rtscts)"},
      {[](LineStatus& line) { line.bytes_in = 1000, line.stray_bytes = 60; },
       "60 of 1000 bytes came when nothing was asked: a second master, answers that come too late, "
       "or noise; look at 'baudgate trace bay-1'"},
      {[](LineStatus& line) { line.times_lost = 2; },
       "the open port was lost 2 times: loose plug, hub or power; the log has the times"},
  };
  const LineStatus well = line_;
  std::vector<std::string> all;
  for (const auto& row : rows) {
    line_ = well;
    row.trouble(line_);
    EXPECT_THAT(SayOfLine(), ElementsAre(row.sentence));
    all.push_back(row.sentence);
  }
  line_ = well;
  for (const auto& row : rows) row.trouble(line_);
  EXPECT_THAT(SayOfLine(), ElementsAreArray(all));
}

TEST_F(DiagnoseTest, AConnectionHasNoPlug) {
  config_.lines[0].port = "tcp://10.0.0.9:4001";
  line_.times_lost = 6;
  EXPECT_THAT(SayOfLine(), ElementsAre("the connection was lost 6 times: look at the serial server "
                                       "(in use by another client, its connection limit, an "
                                       "inactivity time, its power) and at the network"));
}

TEST_F(DiagnoseTest, WhenNobodyAnswersTheLineIsSuspected) {
  EXPECT_THAT(SayOfLine({.in_use = 3, .absent = 3}),
              ElementsAre("none of its 3 devices answers: look at what they share: port, bit rate "
                          "and parity (9600 7E1), A and B swapped, power of the bus"));
  EXPECT_THAT(SayOfLine({.in_use = 3, .absent = 2}), IsEmpty());
  EXPECT_THAT(SayOfLine({.in_use = 1, .absent = 1}), IsEmpty())
      << "one device alone has a sentence of its own";
}

}  // namespace
}  // namespace baudgate::control
