// Tests of the diagnosis of a line: its port, its bytes, and troubles that several devices share.
// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>

#include <functional>
#include <random>
#include <string>
#include <string_view>
#include <vector>

#include "gateway/base/shown.h"
#include "gateway/diagnosis/causes/evidence.h"
#include "tests/gateway/diagnosis/causes/diagnose_fixture.h"

namespace baudgate::diagnosis {
namespace {

using ::testing::ElementsAre;
using ::testing::ElementsAreArray;
using ::testing::IsEmpty;

TEST_F(DiagnoseTest, AClosedPortIsReportedForTheLineNotItsDevices) {
  device().state = bus::DeviceState::offline;
  line_.port = bus::LineStatus::Port::closed;
  line_.port_text = "/dev/ttyUSB0: No such file or directory";
  line_.port_since = status::kNow.wall - 3min;
  EXPECT_THAT(Say(), IsEmpty());
  EXPECT_THAT(SayOfLine(),
              ElementsAre("port closed for 3 min: /dev/ttyUSB0: No such file or directory"));
  line_.port = bus::LineStatus::Port::released;
  line_.released_until = status::kNow.wall + 10min;
  EXPECT_THAT(Say(), IsEmpty());
  EXPECT_THAT(SayOfLine(), ElementsAre("released: the port is lent until 14:23:20 UTC. Run "
                                       "'baudgate release bay-1 --end' to take the port back"));
}

TEST_F(DiagnoseTest, OneCopyOfARequestIsNoEcho) {
  line_.exchanges = 1000;
  line_.echoes = 1;
  line_.echoed = 1;
  EXPECT_THAT(SayOfLine(), IsEmpty()) << "another master may ask the same";
}

TEST_F(DiagnoseTest, ABusWithoutEchoIsNotReportedAsAnOpenRing) {
  line_.exchanges = 100;
  line_.collisions = 90;
  EXPECT_THAT(
      SayOfLine(),
      ElementsAre(
          "the echo was missing, or differed from the request, 90 times. Two masters send at once, "
          "or the bus does not echo (set 'echo: off' at the line)"));
  Looked(device(), Symptom::odd, 9);
  device().state = neighbour_.status.state = bus::DeviceState::offline;
  EXPECT_THAT(
      SayOfLine(),
      ElementsAre(
          "none of its 2 devices answers, and requests do not come back as an "
          "echo (90 times, echo: verify). Close the ring (a loose fibre, a device without power), "
          "or set 'echo: off' for a bus without echo"));
}

TEST_F(DiagnoseTest, EachTroubleOfALineHasItsSentence) {
  const struct {
    std::function<void(bus::LineStatus&)> trouble;
    std::string sentence;
  } rows[] = {
      {[](bus::LineStatus& line) { line.echoes = 12, line.echoed = 0xFFF0FF; },
       "the request itself came back 12 times. Set 'echo: strip' at the line in the configuration"},
      {[](bus::LineStatus& line) { line.collisions = 1; },
       "the echo was missing, or differed from the request, once. Two masters send at once, or the "
       "ring opens now "
       "and then (a loose plug, or a device that restarts)"},
      {[](bus::LineStatus& line) { line.negotiations = 1; },
       "the server speaks Telnet when a connection begins, and doubles each FF. Set its port to "
       "raw TCP, without Telnet or RFC 2217"},
      {[](bus::LineStatus& line) { line.parity_errors = 34, line.framing_errors = 3; },
       "the driver has counted 34 parity and 3 framing errors since the port was opened. Check for "
       "noise, bad termination, or a device with other settings"},
      {[](bus::LineStatus& line) { line.restored = 11; },
       "another program (find it with: fuser -v /dev/ttyUSB0) has changed the settings of the port "
       "11 times, and "
       "the gateway has restored them. Keep that program away from /dev/ttyUSB0"},
      {[](bus::LineStatus& line) { line.overruns = 5; },
       "the driver lost bytes 5 times. The machine is too busy, or the adapter needs flow control "
       "(rtscts)"},
      {[](bus::LineStatus& line) { line.bytes_in = 1000, line.stray_bytes = 60; },
       "60 of 1000 bytes came when nothing was asked. Look for noise between the replies (bias "
       "resistors, termination), or for a second master"},
      {[](bus::LineStatus& line) {
         for (const Duration ago : {Duration(2h), Duration(50min), Duration(1min)})
           line.losses.Add(status::kNow.instant - ago);
       },
       "the open port was lost 2 times in the last hour. Check plug, hub and power; the log has "
       "the times"},
  };
  line_.exchanges = 1000;
  const bus::LineStatus well = line_;
  std::vector<std::string> all;
  for (const auto& row : rows) {
    line_ = well;
    row.trouble(line_);
    EXPECT_THAT(SayOfLine(), ElementsAre(row.sentence));
    all.push_back(row.sentence);
  }
  line_ = well;
  for (const auto& row : rows) row.trouble(line_);
  std::erase_if(all, [](const std::string& one) { return one.starts_with("60 of 1000 bytes"); });
  EXPECT_THAT(SayOfLine(), ElementsAreArray(all)) << "stray bytes are of the echoes";
}

TEST_F(DiagnoseTest, AServerThatClosesAfterEachAnswerIsReportedOnlyWithFailures) {
  line_.exchanges = 100;
  line_.rests = 90;
  EXPECT_THAT(SayOfLine(), IsEmpty()) << "that is no trouble by itself";
  Minute().failed = 3;
  EXPECT_THAT(SayOfLine(), ElementsAre("the server ends the connection after each answer, and 3 "
                                       "polls were missed or failed. Set the server to keep the "
                                       "connection open (its inactivity time, its mode)"));
  line_.rests = 20;
  EXPECT_THAT(SayOfLine(), IsEmpty());
}

TEST_F(DiagnoseTest, StrayBytesAreReportedUnlessADeviceExplainsThem) {
  line_.bytes_in = 1000;
  line_.stray_bytes = 60;
  Looked(device(), Symptom::noise_behind, 2);
  EXPECT_THAT(SayOfLine(), ElementsAre(::testing::StartsWith("60 of 1000 bytes came")));
  Looked(device(), Symptom::noise_behind, 1);
  EXPECT_THAT(SayOfLine(), IsEmpty()) << "the device has a sentence about them";
}

TEST_F(DiagnoseTest, ALostConnectionNamesServerAndNetwork) {
  config_.lines[0].port = "tcp://10.0.0.9:4001";
  for (int i = 0; i < 6; ++i) line_.losses.Add(status::kNow.instant - 1h + i * 1s);
  EXPECT_THAT(SayOfLine(), IsEmpty()) << "one restart";
  for (int i = 0; i < 11; ++i) line_.losses.Add(status::kNow.instant - 1min + i * 5s);
  EXPECT_THAT(
      SayOfLine(),
      ElementsAre(
          "the connection was lost 7 times in the last hour. Check other clients of the server, "
          "its limit of connections, its inactivity time and restarts, and the network"));
}

TEST_F(DiagnoseTest, AConnectionThatEndsInsideRepliesIsReported) {
  config_.lines[0].port = "tcp://10.0.0.9:4001";
  for (int i = 0; i < 3; ++i) line_.losses.Add(status::kNow.instant - 1min + i * 10s);
  NeverAnswered();
  Looked(device(), Symptom::tail_lost, 3);
  const auto says = ElementsAre(
      "the server closes the connection in the middle of replies. Check the server and the device "
      "behind it (firmware, limits)");
  EXPECT_THAT(SayOfLine(), says);
  line_.port = bus::LineStatus::Port::closed;
  EXPECT_THAT(SayOfLine(), says);
}

TEST_F(DiagnoseTest, ALostConnectionIsReportedWhileItReconnects) {
  config_.lines[0].port = "tcp://10.0.0.9:4001";
  line_.port = bus::LineStatus::Port::closed;
  line_.port_text = "it closed the connection";
  line_.port_since = status::kNow.wall - 500ms;
  EXPECT_THAT(SayOfLine(), ElementsAre("port closed for 0.5 s: it closed the connection"));
  for (int i = 0; i < 3; ++i) line_.losses.Add(status::kNow.instant - 1min + i * 10s);
  EXPECT_THAT(SayOfLine(), ElementsAre(::testing::StartsWith("the connection was lost 3 times")));
  line_.port_since = status::kNow.wall - 1min;
  EXPECT_THAT(SayOfLine(), ElementsAre(::testing::StartsWith("port closed for ")));
}

TEST_F(DiagnoseTest, AServerThatEndsConnectionsInUseIsReported) {
  for (const Duration ago : {Duration(10min), Duration(2min), Duration(1min)})
    line_.drops.Add(status::kNow.instant - ago);
  EXPECT_THAT(SayOfLine(), IsEmpty()) << "twice in five minutes";
  line_.drops.Add(status::kNow.instant - 3s);
  EXPECT_THAT(
      SayOfLine(),
      ElementsAre(
          "the server has ended the connection 3 times in the last minutes while "
          "it was in use. Another client takes the connection (end that client, or raise the "
          "limit of connections), or a router or firewall in between ends it"));
  Looked(device(), Symptom::silence, 1, {.ended = true});
  EXPECT_THAT(SayOfLine(), ::testing::SizeIs(1)) << "a connection can end during any request";
  device().queries = {{.first_point = 0, .points = 1},
                      {.first_point = 1, .points = 3, .in_vain = 3, .symptom = Symptom::silence}};
  EXPECT_THAT(SayOfLine(), IsEmpty()) << "the sentence about the device names the request";
}

TEST_F(DiagnoseTest, TheEndsOfConnectionsNameTheirCause) {
  using ::testing::HasSubstr;
  config_.lines[0].port = "tcp://10.0.0.9:4001";
  const auto add = [this](bus::RecentTimes& what, int times) {
    for (int i = times; i > 0; --i) what.Add(status::kNow.instant - i * 20s);
  };
  add(line_.losses, 4);
  line_.use = 0.2;
  struct Row {
    bus::RecentTimes bus::ConnectionEnds::*what;
    int asked;
    int idle;
    const char* says;
    std::uint32_t alike = 1;
  };
  using Ends = bus::ConnectionEnds;
  const Row table[] = {
      {&Ends::refused, 1, 3, "The next connection was refused: check the power and the log"},
      {&Ends::unreachable, 0, 4, "No host answered for a while: check the power of the server"},
      {&Ends::shut, 2, 2, "The next connection was closed at once: end the other client"},
      {&Ends::asked, 4, 0, "A request was under way nearly each time: check load"},
      {&Ends::idle, 1, 3, "Check other clients of the server"},
      {&Ends::idle, 1, 3, "Each connection lasted about 3.3 s: raise the time", 3},
  };
  for (const Row& row : table) {
    line_.ends = {};
    line_.ends.age = 3300ms;
    line_.ends.alike = row.alike;
    add(line_.ends.asked, row.asked);
    add(line_.ends.idle, row.idle);
    if (row.what != &Ends::asked && row.what != &Ends::idle) add(line_.ends.*row.what, 3);
    EXPECT_THAT(SayOfLine(),
                ElementsAre(HasSubstr(std::string("lost 4 times in the last hour. ") + row.says)));
  }
}

TEST_F(DiagnoseTest, APortThatTakesNoDataIsReported) {
  line_.losses.Add(status::kNow.instant - 1min);
  line_.takes_no_data = true;
  const auto say = [this] { return SayOfLine()[0]; };
  using ::testing::EndsWith;
  EXPECT_THAT(say(), EndsWith("in the last hour, because it takes no data. Unplug the adapter and "
                              "plug it in again, or restart the device behind it"));
  config_.lines[0].serial.xonxoff = true;
  EXPECT_THAT(say(), EndsWith("XOFF came, and no XON after it. Switch XON/XOFF off at both ends"));
  config_.lines[0].serial.rtscts = true;
  EXPECT_THAT(say(), EndsWith("Check that the CTS line of the device is connected and active"));
}

TEST_F(DiagnoseTest, DevicesThatFellSilentTogetherAreNamed) {
  for (bus::DeviceStatus* status : {&device(), &neighbour_.status}) {
    status->state = bus::DeviceState::offline;
    status->last_ok = status::kNow.instant - 1min;
    Looked(*status, Symptom::silence, 20);
  }
  bus::DeviceRecord third = neighbour_;
  third.device = {third.line, &config_.lines[0].devices[0]};
  third.status = {};
  third.status.state = bus::DeviceState::online;
  Looked(third.status, Symptom::clean, 32);
  const bus::DeviceRecord all[] = {neighbour_, record_, third};
  EXPECT_THAT(DiagnoseDevice(line_, record_, all, status::kNow, status::kStarted)[0],
              ::testing::HasSubstr("not a byte comes any more, nor from feeder-1 since the same "
                                   "moment. Check what these devices share"));
}

TEST_F(DiagnoseTest, TheLineIsSuspectedWhenNoDeviceAnswers) {
  NeverAnswered();
  Ended(Outcome::no_reply, 5);
  EXPECT_THAT(SayOfLine(), IsEmpty()) << "a neighbour answers";
  neighbour_.status = device();
  EXPECT_THAT(SayOfLine(),
              ElementsAre("none of its 2 devices answers: not a byte came. Check wiring (A and B), "
                          "power, bit rate, parity and protocol (9600 7E1, spabus), direction "
                          "control of the converter; or another program reads the port (find it "
                          "with: fuser -v /dev/ttyUSB0)"));
  EXPECT_THAT(Say(), ElementsAre("has never answered, as no device of line 'bay-1' answers"));
  line_.exchanges = 10;
  line_.parity_errors = 4;
  EXPECT_THAT(
      SayOfLine()[1],
      ::testing::EndsWith(
          "Compare bit rate, parity and data bits (9600 7E1) with the settings of the devices"));
  neighbour_.status.state = bus::DeviceState::disabled;
  EXPECT_THAT(Say()[0], ::testing::HasSubstr("Check power, wires (A and B), then address (2)"))
      << "one device alone has a sentence of its own";
}

TEST_F(DiagnoseTest, AnOpenRingIsReportedForTheLineNotItsDevices) {
  line_.cut_since = status::kNow.wall - 3min;
  line_.collisions = 40;
  EXPECT_THAT(
      SayOfLine(),
      ElementsAre("the ring has been open since 14:10:20 UTC: requests no longer come back as an "
                  "echo. Look for a loose or broken fibre, or a device on the ring without power"));
  device().state = bus::DeviceState::offline;
  EXPECT_THAT(Say(), ElementsAre("cannot be reached, because the ring of line 'bay-1' is open. "
                                 "Close the ring first: the device itself may work"));
}

/// The device is polled every second, and has missed 60 of about 200 polls in the last minutes.
class MissedTest : public DiagnoseTest {
 protected:
  MissedTest() {
    line_.busy = kWatched;
    Minute().missed = 60;
    for (int i = 0; i < 1000; ++i) device().round_trips.Add(38ms);
    for (int i = 0; i < 1000; ++i) neighbour_.status.round_trips.Add(348ms);
  }
  bus::MinuteCounts& Neighbours() { return neighbour_.status.hour.At(status::kNow.instant); }
  static constexpr Duration kWatched = 4min;
  const std::string missed_ = "missed 25 % of its polls in the last minutes: ";
};

TEST_F(MissedTest, AFewMissedPollsAreNotReported) {
  Minute().missed = 2;
  Minute().served = kWatched;
  EXPECT_THAT(Say(), IsEmpty());
  EXPECT_THAT(SayOfLine(), IsEmpty());
}

TEST_F(MissedTest, ALineFullOfGoodExchangesIsReported) {
  Minute().served = kWatched / 5;
  Neighbours().served = kWatched / 5;
  EXPECT_THAT(SayOfLine(), IsEmpty()) << "something else keeps it from its polls";
  Minute().served = kWatched * 44 / 100;
  Neighbours().served = kWatched * 39 / 100;
  EXPECT_THAT(SayOfLine(),
              ElementsAre(::testing::HasSubstr("the polls need more time than the line has")))
      << "both take as much";
  Neighbours().served = kWatched / 10;
  EXPECT_THAT(SayOfLine(),
              ElementsAre("polls are missed: feeder-2 takes 44 % of the line's time, 38 ms per "
                          "exchange. Poll it less often (poll), or ask for fewer points"));
  line_.busy = 4s;
  line_.bytes_in = 3000;
  EXPECT_THAT(SayOfLine(), ElementsAre(::testing::EndsWith("or raise the bit rate")))
      << "the characters take the time";
}

TEST_F(MissedTest, ALongConfiguredQuietTimeIsNamed) {
  Minute().served = Neighbours().served = kWatched / 2;
  device().timing.quiet = neighbour_.status.timing.quiet = 400ms;
  EXPECT_THAT(SayOfLine(), ElementsAre(::testing::HasSubstr("Lower timing.quiet (400ms)")));
  device().timing.quiet = 30ms;
  EXPECT_THAT(SayOfLine(),
              ElementsAre(::testing::HasSubstr("Poll less often (poll), or ask for fewer points")));
}

TEST_F(MissedTest, TheDeviceThatUsesMostOfTheTimeIsNamed) {
  Minute().served = kWatched / 5;
  Neighbours().served = kWatched * 3 / 4;
  const std::string cause =
      "75 % of the line's time, 348 ms per exchange. Poll it less often (poll), or ask for fewer "
      "points";
  EXPECT_THAT(SayOfLine(), ElementsAre("polls are missed: feeder-1 takes " + cause));
  EXPECT_THAT(Say(), ElementsAre(missed_ + "feeder-1 takes " + cause));
}

TEST_F(MissedTest, AFailingNeighbourIsNamed) {
  Neighbours().wasted = kWatched / 2;
  EXPECT_THAT(Say(), IsEmpty()) << "what stands beside its good replies took the time";
  Looked(neighbour_.status, Symptom::damaged, 4);
  EXPECT_THAT(Say(),
              ElementsAre(missed_ + "feeder-1 takes 50 % of the line's time with exchanges that "
                                    "fail. First follow the sentence about that device"));
  EXPECT_THAT(SayOfLine(), IsEmpty()) << "the sentence of feeder-1 says why";
}

TEST_F(MissedTest, AFailingDeviceDoesNotReportMissedPolls) {
  Minute().wasted = kWatched / 2;
  EXPECT_THAT(Say(), IsEmpty());
}

constexpr Instant kStart{1000s};

/// Simulates one exchange per second: 'o' is answered, 'x' fails.
bus::FailureRuns After(std::string_view exchanges) {
  bus::FailureRuns failures;
  Instant now = kStart;
  for (const char exchange : exchanges) failures.Add(exchange == 'o', now += 1s);
  return failures;
}

std::string Times(int times, std::string_view part) {
  std::string text;
  for (int i = 0; i < times; ++i) text += part;
  return text;
}

/// Returns length and period of outages, such as "3.0 s every 15 s"; empty if the failures are
/// single losses.
std::string Shown(const bus::FailureRuns& failures) {
  const auto found = FindAbsences(failures);
  if (!found) return {};
  return FormatAge(found->length) + (found->period ? " every " + FormatAge(*found->period) : "");
}

TEST(Absences, AreDistinguishedFromLosses) {
  const struct {
    std::string exchanges;
    std::string says;
  } rows[] = {
      {Times(30, "o"), ""},
      {Times(30, "x"), ""},
      {Times(30, "o") + "x", ""},
      {Times(30, "o") + "xxo", ""},
      {Times(30, "o") + "xxxxo", "4.0 s"},
      {Times(30, "o") + "xxxx", ""},
      {Times(4, "oooooooooooooxxx") + "o", "3.0 s every 16 s"},
      {Times(4, "oooooxxxxx") + "o", "5.0 s every 10 s"},
      {"ooooooxxxxxooooooooxxxoooooooooooooooooooxxxxoooooo", "4.0 s"},
      {"x" + Times(40, "o") + "xxxxxooo", "5.0 s"},
      {Times(20, "o") + "x" + Times(20, "o") + "xxxxxooo", "5.0 s"},
      {Times(16, "oox"), ""},
      {Times(16, "oxx"), ""},
      {Times(16, "ox"), ""},
      {Times(30, "o") + "xxxxxxxx" + Times(6, "oooox") + "o", ""},
  };
  for (const auto& row : rows) EXPECT_EQ(Shown(After(row.exchanges)), row.says) << row.exchanges;
}

TEST(Absences, AreRarelyFoundInRandomFailures) {
  std::mt19937 random(1);
  int wrong = 0;
  for (int i = 0; i < 2000; ++i) {
    std::bernoulli_distribution fails(0.1 + 0.06 * (i % 10));
    std::string exchanges;
    for (int j = 0; j < 100; ++j) exchanges += fails(random) ? 'x' : 'o';
    wrong += FindAbsences(After(exchanges)).has_value() ? 1 : 0;
  }
  EXPECT_LE(wrong, 4) << "of 2000";
}

TEST(Absences, OfTwoDevicesAtTheSameTimeAreRecognised) {
  const struct {
    std::string one;
    std::string other;
    bool together;
  } rows[] = {
      {"ooooxxxooooxxxoooo", "oooooxxooooxxxxooo", true},
      {"ooooxxxooooxxxoooo", "oooooxxooooooooooo", false},
      {"ooooxxxooooxxxoooo", "oxxoooooxxooooooxx", false},
      {"oooxoooooxoooooxoo", "oooxoooooxoooooxoo", false},
      {"ooooxxxooooxxxoooo", "oooxxxxxxxxxxxxxoo", false},
  };
  for (const auto& row : rows) {
    EXPECT_EQ(AreAwayTogether(After(row.one), After(row.other)), row.together) << row.other;
  }
}

bool FailTogether(const bus::FailureRuns& one, const bus::FailureRuns& other) {
  return CoincidencesOf(one, other).AreNoChance();
}

TEST(Absences, SingleLossesOfTwoDevicesAtTheSameTimeAreRecognised) {
  const std::string seldom = Times(6, "ooooooooxooo") + "o";
  EXPECT_TRUE(FailTogether(After(seldom), After(seldom)));
  EXPECT_FALSE(FailTogether(After(seldom), After("oooo" + seldom)));
  EXPECT_FALSE(FailTogether(After(seldom), After(Times(36, "ox") + "o")))
      << "one fails all the time";
  EXPECT_FALSE(FailTogether(After(seldom), After(Times(40, "o"))));
  EXPECT_FALSE(FailTogether(After("ooooxoooo"), After("ooooxoooo"))) << "once may be chance";
}

TEST(Absences, AFewCoincidencesOfManyDevicesAreEnough) {
  const bus::FailureRuns few = After("oooooooooxooooooooxooooooooxoooooo");
  EXPECT_FALSE(FailTogether(few, few));
  Coincidences all = CoincidencesOf(few, few);
  all.Add(CoincidencesOf(few, few));
  all.Add(CoincidencesOf(few, few));
  EXPECT_TRUE(all.AreNoChance());
}

TEST(Absences, RegularOutagesThatAlternateBetweenDevicesHaveAPeriod) {
  const std::string quiet = "oooooooo";
  const std::string fails = "xooooooo";
  const bus::FailureRuns one = After(quiet + fails + quiet + fails + quiet + fails + quiet);
  const bus::FailureRuns other = After(quiet + quiet + fails + quiet + fails + quiet + fails + "o");
  const bus::FailureRuns random = After("oxoooooooooxoooooxooooooooooooooooooooooxoooooooox");
  const auto period = [](std::initializer_list<const bus::FailureRuns*> devices) {
    return SharedPeriod({devices.begin(), devices.size()});
  };
  EXPECT_EQ(period({&one, &other}), 8s);
  EXPECT_EQ(period({&one}), std::nullopt);
  EXPECT_EQ(period({&one, &random}), std::nullopt);
  const bus::FailureRuns always = After(quiet + fails + fails + fails + fails + fails);
  EXPECT_EQ(period({&always, &always}), 8s);
  const bus::FailureRuns once = After(quiet + fails + quiet + quiet + quiet + quiet);
  EXPECT_EQ(period({&always, &once}), std::nullopt) << "they are one device's own";
}

TEST(Absences, RareAndRegularFailuresAreOutages) {
  EXPECT_EQ(Shown(After(Times(5, "ooooooooox") + "o")), "1.0 s every 10 s");
  EXPECT_EQ(Shown(After(Times(4, "ooooooooox") + "o")), "");
}

TEST(Absences, TwoRandomlyFailingDevicesRarelyFailTogether) {
  std::mt19937 random(2);
  int wrong = 0;
  for (int i = 0; i < 2000; ++i) {
    std::bernoulli_distribution fails(0.05 + 0.04 * (i % 10));
    const auto draw = [&] {
      std::string exchanges;
      for (int j = 0; j < 100; ++j) exchanges += fails(random) ? 'x' : 'o';
      return After(exchanges);
    };
    const bus::FailureRuns one = draw();
    const bus::FailureRuns other = draw();
    wrong += FailTogether(one, other) ? 1 : 0;
  }
  EXPECT_LE(wrong, 4) << "of 2000";
}

TEST(Absences, SilenceIsUsualIfItHasEndedTwiceBefore) {
  const struct {
    std::string exchanges;
    bool usual;
  } rows[] = {
      {"oooo", false},
      {"ooooxxx", false},
      {"ooooxxxooooxxx", false},
      {"ooooxxxooooxxxooooxxxx", true},
      {"ooooxxxooooxxxooooxxxxxxxxxxxx", false},
      {"ooooxxxooooxxxoooo", false},
  };
  for (const auto& row : rows) {
    const Instant now = kStart + std::chrono::seconds(row.exchanges.size());
    EXPECT_EQ(IsUsualSilence(After(row.exchanges), now), row.usual) << row.exchanges;
  }
}

}  // namespace
}  // namespace baudgate::diagnosis
