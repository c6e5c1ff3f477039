// Tests of the subcommands with a control server: what they print, and their exit codes.
// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>
#include <signal.h>
#include <sys/wait.h>
#include <unistd.h>

#include <map>
#include <sstream>
#include <string>

#include "gateway/base/time.h"
#include "gateway/records/history/history_view.h"
#include "gateway/tools/cli/client/control_client.h"
#include "gateway/tools/cli/client/history.h"
#include "gateway/tools/cli/client/operation.h"
#include "gateway/tools/cli/client/status.h"
#include "gateway/tools/cli/client/status_view.h"
#include "tests/gateway/outputs/control/fixture.h"

namespace baudgate::tools {
namespace {

using ::testing::ElementsAre;
using ::testing::EndsWith;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::StartsWith;

class ClientTest : public control::ControlTest {
 protected:
  int Status(const std::string& target, bool json = false) {
    Clear();
    return RunStatus({.target = target, .json = json, .socket = path()}, out_, err_);
  }
  int Release(const std::string& line, Duration time, bool end = false) {
    Clear();
    return RunRelease({line, time, end, path()}, out_, err_);
  }
  int InUse(const std::string& target, bool in_use) {
    Clear();
    return RunInUse({target, in_use, path()}, out_, err_);
  }
  void Clear() {
    out_.str({});
    err_.str({});
  }

  std::ostringstream out_;
  std::ostringstream err_;
};

TEST_F(ClientTest, StatusShowsTablesOrJson) {
  StartServer();
  EXPECT_EQ(Status(""), 0) << err_.str();
  EXPECT_THAT(out_.str(), StartsWith("substation-7: baudgate 1.2.3, up "));
  EXPECT_EQ(Status("bay-1", true), 0);
  EXPECT_EQ(status::Json::parse(out_.str())["lines"].size(), 1U);
  EXPECT_THAT(err_.str(), IsEmpty());
}

TEST(CureOfSilence, NamesAStoppedProcess) {
  const pid_t child = ::fork();
  if (child == 0) {
    ::raise(SIGSTOP);
    ::_exit(0);
  }
  ::waitpid(child, nullptr, WUNTRACED);
  const std::string id = std::to_string(child);
  EXPECT_EQ(CureOfSilence(child),
            "process " + id + " is stopped; continue it with: kill -CONT " + id);
  ::kill(child, SIGKILL);
  ::waitpid(child, nullptr, 0);
  EXPECT_EQ(CureOfSilence(child),
            "process " + id +
                " may hang or get no processor time; check with: systemctl status baudgate, top");
  EXPECT_THAT(CureOfSilence(0), StartsWith("the gateway may hang"));
}

TEST_F(ClientTest, AWatchedStatusRestoresTheTerminal) {
  StartServer();
  const StatusOptions options{.target = "",
                              .socket = path(),
                              .terminal = TableView{.width = 80, .height = 24},
                              .watch = true,
                              .seconds = 1ms};
  EXPECT_EQ(RunStatusWatch(options, out_, err_), 0) << err_.str();
  EXPECT_THAT(out_.str(), StartsWith("\x1b[?1049h"));
  EXPECT_THAT(out_.str(), HasSubstr("\x1b[Hsubstation-7: baudgate 1.2.3, up "));
  EXPECT_THAT(out_.str(), EndsWith("\x1b[?1049l"));
  StopServer();
  Clear();
  EXPECT_EQ(RunStatusWatch(options, out_, err_), 4);
  EXPECT_THAT(out_.str(), IsEmpty()) << "what is wrong stands in the terminal as it is";
  EXPECT_THAT(err_.str(), HasSubstr("no gateway answers"));
}

class PointsClient : public ClientTest {
 protected:
  PointsClient() {
    config::Point& point = config_.lines[1].devices[0].points[0];
    point.name = "setting";
    point.type = config::Type::float32;
    point.access = config::Access::read_write;
    point.writing.allowed = true;
    point.writing.max = 10;
  }
  int Write(const std::string& value, bool json = false) {
    Clear();
    return RunWrite({"io.ai-1.setting", value, false, json, path()}, out_, err_);
  }
};

TEST_F(PointsClient, AWritePrintsItsOutcome) {
  StartServer();
  EXPECT_EQ(Write("7.5"), 0) << err_.str();
  EXPECT_EQ(out_.str(), "io.ai-1.setting: 7.5 written, and read back\n");
  lines_.result = {};
  EXPECT_EQ(Write("7.5"), 0);
  EXPECT_EQ(
      out_.str(),
      "io.ai-1.setting: 7.5 written, and the device has confirmed the write; not read back\n");
  lines_.result = {WriteEnd::unknown, "no reply"};
  EXPECT_EQ(Write("7.5"), kNotDone);
  EXPECT_THAT(out_.str(), IsEmpty());
  EXPECT_EQ(err_.str(),
            "io.ai-1.setting: sent, but the result is unknown: no reply; read the point before you "
            "try again\n");
  lines_.result = {WriteEnd::refused, "NACK 5"};
  EXPECT_EQ(Write("7.5"), kNotDone);
  EXPECT_EQ(err_.str(), "io.ai-1.setting: refused: NACK 5\n");
  EXPECT_EQ(Write("7.5", true), kNotDone);
  EXPECT_EQ(out_.str(), "{\"end\":\"refused\",\"reason\":\"NACK 5\",\"read_back\":false}\n");
}

TEST_F(PointsClient, ARefusedWritePrintsTheReason) {
  StartServer();
  EXPECT_EQ(Write("11"), kNotDone);
  EXPECT_THAT(err_.str(), HasSubstr("not written: 'setting': 11 is above the maximum"));
  EXPECT_EQ(Write("much"), 2);
  EXPECT_THAT(err_.str(), HasSubstr("is not a value of 'setting'"));
  StopServer();
  EXPECT_EQ(Write("1"), 4);
}

TEST_F(PointsClient, ReadPrintsATable) {
  const bus::Sample sample{0, 5.25, Quality::good};
  store_.Update(2, {&sample, 1}, ReadClocks(), 10ms);
  StartServer();
  EXPECT_EQ(RunRead({"io.ai-1.setting", false, path()}, out_, err_), 0) << err_.str();
  EXPECT_THAT(out_.str(), StartsWith("point    value  unit  quality  age\nsetting  5.250  A     "));
  Clear();
  lines_.result = {.reason = "the device is offline"};
  EXPECT_EQ(RunRead({"io.ai-1.setting", false, path()}, out_, err_), kNotDone);
  EXPECT_THAT(out_.str(), HasSubstr("setting  5.250  A     not read now; last quality: "));
  EXPECT_THAT(err_.str(), HasSubstr("io.ai-1.setting: the device is offline"));
}

TEST_F(ClientTest, UnknownNamesAreWrongUsage) {
  StartServer();
  EXPECT_EQ(Status("bay-2"), 2);
  EXPECT_THAT(err_.str(), HasSubstr("there is no line 'bay-2'; did you mean 'bay-1'?"));
  EXPECT_EQ(Release("bay-2", 1min), 2);
  EXPECT_EQ(InUse("bay-1.feeder-3", false), 2);
  EXPECT_THAT(out_.str(), IsEmpty());
}

TEST_F(ClientTest, WithoutAGatewayTheSearchedPathsAreNamed) {
  EXPECT_EQ(Status(""), 4);
  EXPECT_THAT(err_.str(), HasSubstr("no gateway answers at " + path()));
  EXPECT_THAT(err_.str(), HasSubstr("start baudgate, or name its socket with --socket PATH"));
  EXPECT_EQ(Release("io", 1min), 4);
  EXPECT_EQ(InUse("io.ai-1", true), 4);
}

TEST_F(ClientTest, TheOnlyGatewayInTheDefaultPlacesIsFound) {
  const control::RuntimeDirectory runtime(directory_);
  std::filesystem::create_directory(directory_ / "baudgate");
  const auto connect = [] { return ControlClient::Connect({}); };
  // A real gateway could run on this machine, so the test does not expect that none is found.
  config_.socket = (directory_ / "baudgate" / "a.sock").string();
  StartServer();
  asio::io_context io;
  config::Config other = config_;
  other.socket = (directory_ / "baudgate" / "b.sock").string();
  {
    control::ControlServer second(other, store_, lines_, lines_, {"1", status::kStarted}, io);
    ASSERT_TRUE(second.Listen());
    const auto several = connect();
    ASSERT_FALSE(several);
    EXPECT_THAT(several.error(), HasSubstr("several gateways run here"));
    EXPECT_THAT(several.error(), HasSubstr(config_.socket + ", " + other.socket));
    second.Stop();
  }
  {
    const asio::local::stream_protocol::acceptor dead(
        io, asio::local::stream_protocol::endpoint(other.socket));
  }
  const auto one = connect();
  ASSERT_TRUE(one) << one.error();
  EXPECT_EQ(one->path(), config_.socket) << "what a dead process left does not count";
}

TEST_F(ClientTest, ReleaseWaitsForThePortAndPrintsItsEndTime) {
  status::SetOpen(store_, 1, "serial");
  StartServer();
  EXPECT_EQ(Release("io", 10min), 0) << err_.str();
  EXPECT_THAT(out_.str(), StartsWith("io: /dev/ttyUSB1 is free for another program until "));
  EXPECT_THAT(out_.str(), HasSubstr(" UTC, and the points of the line are out of service"));
  EXPECT_EQ(Release("io", 10min, true), 0);
  EXPECT_EQ(out_.str(), "io: the port was taken back, and is now open: serial\n");
  EXPECT_EQ(Release("io", 10min, true), 0);
  EXPECT_EQ(out_.str(), "io: the line was not released\n");
  EXPECT_EQ(Release("io", 25h), 2);
  EXPECT_THAT(err_.str(), HasSubstr("for 1s to 24h"));
  EXPECT_THAT(lines_.calls(), ElementsAre("release 1 for 10min", "take back 1", "take back 1"));
}

TEST_F(ClientTest, DisableWarnsThatARestartForgetsIt) {
  StartServer();
  EXPECT_EQ(InUse("bay-1.feeder-2", false), 0);
  EXPECT_EQ(out_.str(),
            "bay-1.feeder-2: disabled; the gateway does not poll it, and its points are out of "
            "service. This lasts until the gateway restarts; to keep it, set 'enabled: false' for "
            "the device in the configuration\n");
  EXPECT_EQ(InUse("bay-1.feeder-2", true), 0);
  EXPECT_EQ(out_.str(), "bay-1.feeder-2: enabled; the gateway polls it again\n");
}

struct KeptReadings final : events::EventSource {
  events::EventsState state() const override {
    events::EventsState state;
    state.disk = records::Disk::fine;
    return state;
  }
  std::vector<events::Alarm> Alarms() const override { return {}; }
  std::size_t Acknowledge(const events::AckQuery&,
                          std::function<void(const events::Acknowledged&)>) override {
    return 0;
  }
  Result<events::Page> Read(const events::PageQuery&) const override { return events::Page(); }
  Result<events::PastPage> ReadPast(const events::PastQuery& query) const override {
    events::PastPage page;
    const auto found = rows.find(query.line + "." + query.device + "." + query.name);
    page.known = found != rows.end();
    if (!page.known) return page;
    for (const events::PastRow& row : found->second) {
      const bool since = !query.since || row.time >= *query.since;
      if (since && (!query.until || row.time < *query.until)) page.rows.push_back(row);
    }
    return page;
  }

  void Add(const std::string& name, const std::string& time, Value value,
           Quality quality = Quality::good) {
    rows[name].push_back({*ParseWallTime(time), {}, std::move(value), quality});
  }
  std::map<std::string, std::vector<events::PastRow>> rows;
};

class BillingTest : public control::ControlTest {
 protected:
  BillingTest() {
    // The meter is at +03:00.
    for (const char* name : {"active_import", "active_export"}) {
      const std::string month = std::string("bay-1.feeder-1.month.") + name;
      const double more = name[7] == 'e' ? 1000 : 0;
      kept_.Add(month, "2026-09-30T21:00:00.000Z", 1500.25 + more);
      kept_.Add(month, "2026-10-31T21:00:00.000Z", 1750.5 + more);
    }
    kept_.Add("bay-1.feeder-1.month.active_import_t2", "2026-10-31T21:00:00.000Z", 250.0);
    kept_.Add("bay-1.feeder-1.day.active_import", "2026-11-01T21:00:00.000Z", {},
              Quality::bad_configuration);
    status::GatewayInfo info{"1.2.3", status::kStarted};
    info.events = &kept_;
    StartServerWith(std::move(info));
  }
  ~BillingTest() override { StopServer(); }

  int Run(HistoryOptions options) {
    out_.str({});
    err_.str({});
    options.socket = path();
    if (options.points.empty()) options.points = {"bay-1.feeder-1"};
    return RunBilling(options, out_, err_);
  }

  KeptReadings kept_;
  std::ostringstream out_;
  std::ostringstream err_;
};

TEST_F(BillingTest, PrintsReadingsAndTariffsByTheDateOfTheMeter) {
  ASSERT_EQ(Run({}), 0) << err_.str();
  EXPECT_EQ(
      out_.str(),
      "meter           reading  date        tariff  import kWh  export kWh  quality\n"
      "bay-1.feeder-1  month    2026-10-01  all     1500.25     2500.25\n"
      "bay-1.feeder-1  month    2026-11-01  all     1750.5      2750.5\n"
      "bay-1.feeder-1  month    2026-11-01  2       250.0\n"
      "bay-1.feeder-1  day      2026-11-02  all                             bad: configuration\n");
  EXPECT_THAT(err_.str(), IsEmpty());
}

TEST_F(BillingTest, CsvHasPlainNumbersAndEmptyCells) {
  HistoryOptions options;
  options.csv = true;
  options.since = ParseWallTime("2026-11-01").value();
  options.until = ParseWallTime("2026-11-02").value();
  ASSERT_EQ(Run(options), 0) << err_.str();
  EXPECT_EQ(out_.str(),
            "meter,reading,date,tariff,active_import_kwh,active_export_kwh,reactive_import_kvarh,"
            "reactive_export_kvarh,quality_text\r\n"
            "bay-1.feeder-1,month,2026-11-01,all,1750.5,2750.5,,,good\r\n"
            "bay-1.feeder-1,month,2026-11-01,2,250.0,,,,good\r\n");
}

TEST_F(BillingTest, JsonHasOneObjectPerLine) {
  HistoryOptions options;
  options.json = true;
  options.since = ParseWallTime("2026-11-02").value();
  ASSERT_EQ(Run(options), 0) << err_.str();
  const auto row = status::Json::parse(out_.str());
  EXPECT_EQ(row["date"], "2026-11-02");
  EXPECT_EQ(row["time"], "2026-11-01T21:00:00.000Z");
  EXPECT_EQ(row["tariff"], 0);
  EXPECT_TRUE(row["active_import"].is_null());
}

TEST_F(BillingTest, MissingReadingsAreExplained) {
  EXPECT_EQ(Run({.points = {"bay-1.feeder-2"}}), 2);
  EXPECT_THAT(out_.str(), IsEmpty());
  EXPECT_EQ(Run({.points = {"bay-1.nobody"}}), 2);
  EXPECT_THAT(err_.str(), HasSubstr("nobody"));
  HistoryOptions options;
  options.until = ParseWallTime("2020-01-01").value();
  EXPECT_EQ(Run(options), 0);
  EXPECT_EQ(out_.str(), "no billing readings are stored for the requested time\n");
}

struct OneValueEach final : history::HistorySource {
  history::HistoryState state() const override {
    history::HistoryState state;
    state.disk = records::Disk::fine;
    return state;
  }
  Result<history::Page> Read(const history::PageQuery&) const override {
    history::Page page;
    page.known = true;
    page.records.emplace_back().entry = {history::ToMillis(status::kNow.wall), 1.5, Quality::good};
    return page;
  }
  Result<history::TrendPage> ReadTrends(const history::TrendQuery&) const override {
    return history::TrendPage();
  }
};

class HistoryClient : public control::ControlTest {
 protected:
  HistoryClient() {
    config_.history.points = {{.device = 0, .point = 0}, {.device = 1, .point = 0}};
    status::GatewayInfo info{"1.2.3", status::kStarted};
    info.history = std::make_shared<OneValueEach>();
    StartServerWith(info);
  }
  int Run(std::vector<std::string> points, std::size_t width = 0) {
    out_.str({});
    return RunHistory({.points = std::move(points), .socket = path(), .width = width}, out_, err_);
  }

  std::ostringstream out_;
  std::ostringstream err_;
};

TEST_F(HistoryClient, PatternsMatchTheStoredPoints) {
  EXPECT_EQ(Run({"*.*.curr*", "bay-1.feeder-1.current"}), 0) << err_.str();
  EXPECT_EQ(
      out_.str(),
      "time                      point                                        value  quality\n"
      "2026-09-21T14:13:20.000Z  bay-1.feeder-1.current                       1.500  good\n"
      "2026-09-21T14:13:20.000Z  bay-1.feeder-2.current                       1.500  good\n");
}

TEST_F(HistoryClient, PatternsWithoutAMatchAreExplained) {
  EXPECT_EQ(Run({"bay-1.*.power"}), 2);
  EXPECT_THAT(err_.str(), HasSubstr("no point matches 'bay-1.*.power'"));
  EXPECT_EQ(Run({"*.*.voltage"}), 2);
  EXPECT_THAT(err_.str(), HasSubstr("no point that matches '*.*.voltage' is recorded"));
}

TEST_F(HistoryClient, FitsATerminal) {
  EXPECT_EQ(Run({"bay-1.feeder-1.current"}, 60), 0);
  EXPECT_EQ(out_.str(),
            "time                      point                   value\n"
            "    quality\n"
            "2026-09-21T14:13:20.000Z  bay-1.feeder-1.current  1.500\n"
            "    good\n");
}

}  // namespace
}  // namespace baudgate::tools

namespace baudgate::tools {
namespace {

using ::testing::ElementsAre;
using Json = nlohmann::ordered_json;

Json Device(const std::string& name, const std::string& state, int ok, const std::string& says) {
  return {{"name", name},
          {"state", state},
          {"maintenance", nullptr},
          {"recent", {{"exchanges", 32}, {"ok", ok}}},
          {"advice", Json::array({says})}};
}

TEST(StatusSentences, TheWorstTroubleIsListedFirst) {
  Json status;
  status["modbus"] = {{"masters", Json::array()}, {"routes", Json::array()}};
  status["lines"] = Json::array(
      {{{"name", "bay"},
        {"advice", Json::array({"noise"})},
        {"devices", Json::array({Device("healthy", "online", 30, "two replies were late"),
                                 Device("culprit", "online", 8, "its replies come damaged"),
                                 Device("dead", "offline", 32, "not a byte came")})}}});
  EXPECT_THAT(AdviceOf(status), ElementsAre("bay: noise", "bay.dead: not a byte came",
                                            "bay.culprit: its replies come damaged",
                                            "bay.healthy: two replies were late"));
}

TEST(StatusSentences, EachSectionContributesItsAdvice) {
  const Json status = {{"gateway", "plant"},
                       {"lines", Json::array()},
                       {"dds", {{"advice", Json::array({"the process has not connected yet"})}}},
                       {"new-output", {{"advice", Json::array({"nobody listens"})}}},
                       {"audit", nullptr},
                       {"files", {{"advice", Json::array()}}}};
  EXPECT_THAT(AdviceOf(status),
              ElementsAre("DDS: the process has not connected yet", "new-output: nobody listens"));
}

}  // namespace
}  // namespace baudgate::tools
