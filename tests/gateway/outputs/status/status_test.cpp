// Tests of the whole status, as JSON and as text.
// SPDX-License-Identifier: Apache-2.0
#include "gateway/tools/cli/client/status.h"

#include <gmock/gmock.h>

#include "gateway/outputs/status/status_json.h"
#include "gateway/tools/cli/client/status_view.h"
#include "tests/gateway/outputs/status/two_lines.h"

namespace baudgate::status {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::Not;

class StatusTest : public ::testing::Test {
 protected:
  StatusTest() {
    SetOpen(store_, 0, "serial /dev/ttyUSB0 9600 7E1");
    AddExchanges(store_, 0, Outcome::no_reply, 2, kNow);
    AddExchanges(store_, 0, Outcome::ok, 990, kNow, 24ms);
    AddExchanges(store_, 0, Outcome::ok, 8, {kNow.instant - 300ms, kNow.wall - 300ms}, 120ms);
    AddExchanges(store_, 1, Outcome::ok, 10, {kNow.instant - 12min, kNow.wall - 12min}, 24ms);
    AddExchanges(store_, 1, Outcome::no_reply, 90, kNow);
    store_.UpdateStatus(
        1, [](bus::DeviceStatus& status) { status.state = bus::DeviceState::offline; });
    store_.SetOverride(1, Quality::bad_communication);
    store_.UpdateLine(0, [](bus::LineStatus& status) {
      status.use = 0.38;
      status.notice_bound = 9s;
      status.probes = 80;
      status.bytes_in = 12'000;
      status.bytes_out = 9'000;
      status.busy = 68min;
    });
    store_.UpdateLine(1, [](bus::LineStatus& status) {
      status.port_text = "/dev/ttyUSB1: No such file or directory";
      status.port_since = kNow.wall - 3min;
    });
    const bus::Sample samples[] = {{0, 1.25, Quality::good}};
    store_.Update(0, samples, {kNow.instant - 300ms, kNow.wall - 300ms}, 24ms);
  }

  Json Status(const std::string& target = {}) const {
    std::optional<Target> found;
    if (!target.empty()) found = FindTarget(config_, target).value();
    return StatusJson(config_, store_, {"1.2.3", kStarted}, found, kNow);
  }
  std::string Frame(std::size_t width, std::size_t height) const {
    return tools::RenderStatusFrame(Status(), {.width = width, .height = height});
  }
  std::string Shown(const std::string& target = {}) const {
    return tools::RenderStatus(Status(target), target, {});
  }

  config::Config config_ = TwoLines();
  bus::PointStore store_{config_};
};

TEST_F(StatusTest, TheOverviewShowsLinesDevicesAndTroubles) {
  EXPECT_EQ(Shown(), R"(substation-7: baudgate 1.2.3, up 3 h, lines: 2, devices: 3, online: 1

line   port     use  exchanges  no reply  corrupt  late  online
bay-1  open    38 %       1100        92        0     0  1 of 2
io     closed   0 %          0         0        0     0  0 of 1

device          state       last      answered      ok   mean    p99  retries  missed
bay-1.feeder-1  online      ok           0.3 s  99.8 %  25 ms  28 ms        0       0
bay-1.feeder-2  offline     no reply    12 min  10.0 %  24 ms  28 ms        0       0
io.ai-1         never seen  none             -       -      -      -        0       0

bay-1.feeder-2: offline for 12 min: not a byte comes any more. Check its power and its wire, and whether its settings were changed
bay-1.feeder-2: feeder-1 answers on the same line
bay-1.feeder-2: the gateway notices its return within 9.0 s
io: port closed for 3 min: /dev/ttyUSB1: No such file or directory
)");
}

TEST_F(StatusTest, AFrameShowsTheWorstFirstAndFitsTheTerminal) {
  EXPECT_EQ(Frame(80, 24), R"(substation-7: baudgate 1.2.3, up 3 h, lines: 2, devices: 3, online: 1

line   port     use  exchanges  no reply  corrupt  late  online
io     closed   0 %          0         0        0     0  0 of 1
bay-1  open    38 %       1100        92        0     0  1 of 2

device          state       last      answered      ok   mean    p99  retries
io.ai-1         never seen  none             -       -      -      -        0
bay-1.feeder-2  offline     no reply    12 min  10.0 %  24 ms  28 ms        0
bay-1.feeder-1  online      ok           0.3 s  99.8 %  25 ms  28 ms        0

io: port closed for 3 min: /dev/ttyUSB1: No such file or directory
bay-1.feeder-2: offline for 12 min: not a byte comes any more. Check its power
  and its wire, and whether its settings were changed
bay-1.feeder-2: feeder-1 answers on the same line
bay-1.feeder-2: the gateway notices its return within 9.0 s
)");
  EXPECT_EQ(Frame(60, 12), R"(substation-7: baudgate 1.2.3, up 3 h, lines: 2, devices: 3,
  online: 1

device   state       last  answered  ok  mean  p99  retries
io.ai-1  never seen  none         -   -     -    -        0
… 2 more

io: port closed for 3 min: /dev/ttyUSB1: No such file or
  directory
… 3 more
)");
}

TEST(StatusFrame, PartsShareTheHeight) {
  EXPECT_THAT(tools::Shares(20, {3, 50, 50}), ElementsAre(3, 8, 9));
  EXPECT_THAT(tools::Shares(20, {3, 4, 5}), ElementsAre(3, 4, 5));
  EXPECT_THAT(tools::Shares(0, {3, 0}), ElementsAre(0, 0));
}

/// Returns `text` without the rest of the row behind `last`, where new counters are added.
std::string CutBehind(std::string_view last, std::string text) {
  const std::size_t at = text.find(last);
  if (at == std::string::npos) return text;
  const std::size_t end = at + last.size();
  return text.erase(end, text.find('\n', end) - end);
}

TEST_F(StatusTest, ALineIsShownWithItsCountersAndAChart) {
  EXPECT_EQ(CutBehind("overruns 0", Shown("bay-1")), R"(bay-1: spabus on /dev/ttyUSB0, 9600 7E1
  port        open (serial /dev/ttyUSB0 9600 7E1) since 2026-09-21T11:13:20.000Z, lost: 0
  use         38 % of the last full minute; since the start, busy 68 min of 3 h
  exchanges   1100: ok 1008, no reply 92
  bytes       12000 in, 9000 out, 0 stray
  trouble     late 0, echoes 0, collisions 0, parity errors 0, framing errors 0, overruns 0
  absent      probed 80 times; a new answer is noticed within 9.0 s

  round trips: mean 25 ms, half within 28 ms, 99 % within 28 ms
  up to   33 ms  ########################################  1000
  up to   66 ms                                            0
  up to  131 ms  #                                         8

device          state    last      answered      ok   mean    p99  retries  missed
bay-1.feeder-1  online   ok           0.3 s  99.8 %  25 ms  28 ms        0       0
bay-1.feeder-2  offline  no reply    12 min  10.0 %  24 ms  28 ms        0       0

bay-1.feeder-2: offline for 12 min: not a byte comes any more. Check its power and its wire, and whether its settings were changed
bay-1.feeder-2: feeder-1 answers on the same line
bay-1.feeder-2: the gateway notices its return within 9.0 s
)");
}

TEST_F(StatusTest, ADeviceIsShownWithItsPoints) {
  store_.UpdateStatus(0, [](bus::DeviceStatus& status) {
    status.last_reason = "no answer";
    status.late = 2;
    status.lateness = 80ms;
  });
  EXPECT_EQ(CutBehind("(by up to 80 ms)", Shown("bay-1.feeder-1")),
            R"(bay-1.feeder-1: spabus, address 1, profile toy
  state       online
  last        ok; last trouble: no answer
  answered    0.3 s ago
  exchanges   1000: ok 998, no reply 2
  trouble     retries 0, missed periods 0, late 2 (by up to 80 ms)
  points      2: 1 good, 0 uncertain, 1 bad

  round trips: mean 25 ms, half within 28 ms, 99 % within 28 ms
  up to   33 ms  ########################################  990
  up to   66 ms                                            0
  up to  131 ms  #                                         8

device    point    value  unit  quality                          age
feeder-1  current  1.250  A     good                           0.3 s
          voltage      -  A     bad: waiting for initial data      -

all is well
)");
}

TEST_F(StatusTest, ADeviceIsShownWithItsLearnedLimits) {
  EXPECT_THAT(Shown("bay-1.feeder-1"), Not(HasSubstr("learned")));
  store_.UpdateStatus(0, [](bus::DeviceStatus& status) { status.learned = "at most 4 items"; });
  EXPECT_THAT(Shown("bay-1.feeder-1"), HasSubstr("\n  learned     at most 4 items\n"));
  EXPECT_EQ(Status()["lines"][0]["devices"][0]["learned"], "at most 4 items");
  EXPECT_EQ(Status()["lines"][0]["devices"][1]["learned"], "");
}

TEST_F(StatusTest, AnOpenRingIsShownInTheTableOfLines) {
  EXPECT_EQ(Status()["lines"][0]["echo_lost_since"], nullptr);
  store_.UpdateLine(0, [](bus::LineStatus& status) { status.cut_since = kNow.wall - 3min; });
  EXPECT_THAT(Shown(), HasSubstr("\nbay-1  open, no echo "));
  EXPECT_EQ(Status()["lines"][0]["echo_lost_since"], "2026-09-21T14:10:20.000Z");
}

TEST_F(StatusTest, AHealthyLineIsShownAsAllIsWell) {
  store_.UpdateStatus(1, [](bus::DeviceStatus& status) { status = {}; });
  store_.SetOverride(1, std::nullopt);
  AddExchanges(store_, 1, Outcome::ok, 10, kNow);
  const bus::Sample samples[] = {{0, 1.25, Quality::good}};
  store_.Update(1, samples, kNow, 24ms);
  EXPECT_THAT(Shown("bay-1"), ::testing::EndsWith("\nall is well\n"));
}

TEST(FilesJson, ReportsExhaustedDescriptorsAndUnwritableFiles) {
  EXPECT_TRUE(FilesJson({.open = 252, .limit = 256})["advice"].empty());
  EXPECT_TRUE(FilesJson({.open = 252, .limit = 0})["advice"].empty());
  const Json none = FilesJson({.open = 253, .limit = 256, .troubles = {"cannot write x"}});
  ASSERT_EQ(none["advice"].size(), 2U);
  EXPECT_EQ(none["advice"][0],
            "253 of at most 256 files are open, so opening another file may fail: too many open "
            "files; raise LimitNOFILE of the service (ulimit -Hn)");
  EXPECT_EQ(none["advice"][1], "cannot write x");
}

TEST_F(StatusTest, AJustStartedGatewayShowsNoNumbers) {
  const bus::PointStore fresh(config_);
  const std::string text = tools::RenderStatus(
      StatusJson(config_, fresh, {"1.2.3", kNow.instant}, std::nullopt, kNow), {}, {});
  EXPECT_THAT(text, HasSubstr("bay-1: port closed: not opened yet"));
  EXPECT_THAT(text, Not(HasSubstr("nan")));
}

TEST_F(StatusTest, JsonHasEveryCounterUnderItsUsualName) {
  const Json status = Status();
  EXPECT_EQ(status["gateway"], "substation-7");
  EXPECT_EQ(status["uptime_ms"], 3 * 3600 * 1000);
  const Json& line = status["lines"][0];
  EXPECT_EQ(line["outcomes"].size(), 9U);
  EXPECT_EQ(line["outcomes"]["no_reply"], 92);
  EXPECT_EQ(line["notice_bound_ms"], 9000);
  EXPECT_EQ(status["lines"][1]["notice_bound_ms"], nullptr);
  const Json& device = line["devices"][1];
  EXPECT_EQ(device["state"], "offline");
  EXPECT_EQ(device["last_outcome"], "no_reply");
  EXPECT_EQ(device["age_ms"], 12 * 60 * 1000);
  EXPECT_EQ(device["points"], (Json{{"count", 2},
                                    {"good", 0},
                                    {"uncertain", 0},
                                    {"bad", 2},
                                    {"write_only", 0},
                                    {"maintenance", 0}}));
  EXPECT_FALSE(device.contains("values")) << "values come when the device is asked for";
  EXPECT_EQ(status["lines"][1]["devices"][0]["age_ms"], nullptr);
}

TEST_F(StatusTest, DevicesInMaintenanceAndWriteOnlyPointsAreCountedApart) {
  const Json before = Status();
  const std::size_t all = before["sums"]["devices"]["count"];
  EXPECT_EQ(before["sums"]["devices"]["maintenance"], 0);
  EXPECT_EQ(before["lines"][0]["maintenance"], nullptr);
  store_.UpdateStatus(1,
                      [](bus::DeviceStatus& status) { status.state = bus::DeviceState::disabled; });
  Json status = Status();
  const Json& device = status["lines"][0]["devices"][1];
  EXPECT_EQ(device["maintenance"], "disabled");
  EXPECT_EQ(device["state_text"], "in maintenance: disabled");
  EXPECT_EQ(device["points"]["count"], 0);
  EXPECT_EQ(device["points"]["bad"], 0);
  EXPECT_EQ(device["points"]["maintenance"], 2);
  EXPECT_EQ(status["sums"]["devices"]["count"], all);
  EXPECT_EQ(status["sums"]["devices"]["maintenance"], 1);
  EXPECT_EQ(status["sums"]["devices"]["offline"],
            before["sums"]["devices"]["offline"].get<int>() - 1);
  EXPECT_EQ(status["sums"]["points"]["bad"], before["sums"]["points"]["bad"].get<int>() - 2);
  store_.UpdateLine(1, [](bus::LineStatus& line) { line.port = bus::LineStatus::Port::released; });
  status = Status();
  EXPECT_EQ(status["lines"][1]["maintenance"], "lent");
  EXPECT_EQ(status["lines"][1]["devices"][0]["maintenance"], "lent");
  EXPECT_EQ(status["lines"][1]["devices"][0]["points"]["count"], 0);
}

TEST_F(StatusTest, JsonHasBusyTimeAndRecentOutcomesOfADevice) {
  store_.UpdateStatus(0, [](bus::DeviceStatus& status) { status.busy = 1500ms; });
  const Json device = Status()["lines"][0]["devices"][0];
  EXPECT_EQ(device["busy_ms"], 1500);
  EXPECT_EQ(device["recent"],
            Json::parse(R"({"exchanges":32,"ok":32,"no_reply":0,"partial":0,"corrupt":0,
              "unexpected":0,"busy":0,"refused":0,"unsupported":0,"line_down":0})"));
}

TEST_F(StatusTest, HistogramsCountEveryRoundTripOnce) {
  const Json trips = Status()["lines"][0]["devices"][0]["round_trips"];
  ASSERT_EQ(trips["histogram"].size(), 2U);
  EXPECT_EQ(trips["histogram"][0]["count"], 990);
  EXPECT_GE(trips["histogram"][0]["up_to_us"], 24'000);
  EXPECT_LT(trips["histogram"][0]["up_to_us"], 24'000 * 1.2);
  EXPECT_EQ(trips["histogram"][1]["count"], 8);
  EXPECT_EQ(trips["count"], 998);
  EXPECT_EQ(trips["last_us"], 120'000);
}

TEST_F(StatusTest, TheJsonOfADeviceHasOnlyItsOwnValues) {
  const Json status = Status("bay-1.feeder-1");
  ASSERT_EQ(status["lines"].size(), 1U);
  ASSERT_EQ(status["lines"][0]["devices"].size(), 1U);
  EXPECT_EQ(
      status["lines"][0]["devices"][0]["values"],
      Json::parse(R"([{"point":"current","value":1.25,"shown":"1.250","unit":"A","quality":192,
              "quality_text":"good","age_ms":300},
              {"point":"voltage","value":null,"shown":"","unit":"A","quality":32,
              "quality_text":"bad: waiting for initial data","age_ms":null}])"));
}

TEST_F(StatusTest, BytesOfADeviceInAReasonDoNoHarm) {
  store_.UpdateStatus(1, [](bus::DeviceStatus& status) {
    status.last_outcome = Outcome::corrupt;
    status.last_reason = "\x1b[2J\xFF";
  });
  EXPECT_THAT(Shown(), Not(HasSubstr("\x1b")));
  EXPECT_THAT(Shown("bay-1.feeder-2"), Not(HasSubstr("\x1b")));
}

}  // namespace
}  // namespace baudgate::status
