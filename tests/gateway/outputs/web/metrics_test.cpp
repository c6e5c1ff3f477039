// SPDX-License-Identifier: Apache-2.0
#include "gateway/outputs/web/metrics.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>
#include <fstream>
#include <functional>
#include <iterator>
#include <nlohmann/json.hpp>
#include <regex>
#include <set>
#include <sstream>
#include <utility>
#include <vector>

#include "gateway/outputs/dds/output/dds_output.h"
#include "gateway/outputs/modbus/server/modbus_output.h"
#include "tests/gateway/outputs/fake_output.h"
#include "tests/gateway/outputs/status/two_lines.h"
#include "tests/gateway/outputs/web/fakes.h"
#include "tests/gateway/outputs/web/fixture.h"
#include "tests/support/renew_store.h"

namespace baudgate::web {
namespace {

using status::kNow;
using ::testing::HasSubstr;
using ::testing::Not;

class MetricsTest : public ::testing::Test {
 protected:
  MetricsTest() {
    status::SetOpen(store_, 0, "serial");
    status::AddExchanges(store_, 0, Outcome::ok, 3, kNow);
    status::AddExchanges(store_, 0, Outcome::no_reply, 1, kNow);
    store_.UpdateLine(0, [](bus::LineStatus& status) { status.spent = {1s, 0s, 0s, 0s, 2s, 0s}; });
    Put(0, {Value(1.25), Quality::good});
    Put(1, {Value(0.5), {Quality::bad_sensor_failure, Reason::open_sensor}});
  }
  struct Reading {
    Value value;
    Quality quality;
  };
  void Put(std::uint32_t point, const Reading& reading) {
    const std::array<bus::Sample, 1> samples = {{{point, reading.value, reading.quality}}};
    store_.Update(0, samples, {kNow.instant - 1500ms, kNow.wall - 1500ms}, 20ms);
  }
  std::string Text() { return MetricsText(config_, store_, {"1.2.3", status::kStarted}, kNow); }

  config::Config config_ = status::TwoLines();
  bus::PointStore store_{config_};
};

TEST_F(MetricsTest, AreRenderedFromTheStore) {
  const std::string text = Text();
  for (const char* line : {
           "baudgate_build_info{version=\"1.2.3\"} 1\n",
           "baudgate_line_up{line=\"bay-1\"} 1\n",
           "baudgate_line_up{line=\"io\"} 0\n",
           "baudgate_line_busy_seconds_total{line=\"bay-1\",why=\"silence\"} 2\n",
           "baudgate_log_dropped_total 0\n",
           "baudgate_exchange_duration_seconds_bucket{line=\"bay-1\",le=\"+Inf\"} 3\n",
           "baudgate_exchange_duration_seconds_count{line=\"bay-1\"} 3\n",
           "baudgate_device_state{line=\"bay-1\",device=\"feeder-1\",state=\"online\"} 1\n",
           "baudgate_device_state{line=\"bay-1\",device=\"feeder-1\",state=\"offline\"} 0\n",
           "baudgate_device_state{line=\"io\",device=\"ai-1\",state=\"never seen\"} 1\n",
           "baudgate_exchanges_total{line=\"bay-1\",device=\"feeder-1\",outcome=\"ok\"} 3\n",
           "baudgate_exchanges_total{line=\"bay-1\",device=\"feeder-1\",outcome=\"no_reply\"} 1\n",
           "baudgate_point_value{line=\"bay-1\",device=\"feeder-1\",point=\"current\",unit=\"A\"} "
           "1.25\n",
           "baudgate_point_quality{line=\"bay-1\",device=\"feeder-1\",point=\"current\"} 192\n",
           "baudgate_point_age_seconds{line=\"bay-1\",device=\"feeder-1\",point=\"current\"} 1.5\n",
           "baudgate_point_quality{line=\"bay-1\",device=\"feeder-1\",point=\"voltage\"} 784\n",
           "baudgate_device_last_ok_timestamp_seconds{line=\"bay-1\",device=\"feeder-1\"} "
           "1790000000\n",
       }) {
    EXPECT_THAT(text, HasSubstr(line));
  }
  EXPECT_THAT(text, Not(HasSubstr("baudgate_point_value{line=\"bay-1\",device=\"feeder-1\","
                                  "point=\"voltage\"")))
      << "what is not good has no value";
}

TEST_F(MetricsTest, TheSamplesOfAMetricFollowItsTypeLine) {
  std::istringstream lines(Text());
  std::set<std::string> done;
  std::string current;
  for (std::string line; std::getline(lines, line);) {
    if (line.starts_with("# TYPE ")) {
      current = line.substr(7, line.find(' ', 7) - 7);
      EXPECT_TRUE(done.insert(current).second) << line;
      EXPECT_EQ(line.ends_with(" counter"), current.ends_with("_total")) << line;
    } else if (!line.starts_with('#')) {
      EXPECT_TRUE(line.starts_with(current)) << line;
    }
  }
}

TEST_F(MetricsTest, RequestsAndSamplesAreCounted) {
  modbus::TrafficStatus traffic;
  traffic.functions = {{"0.0.0.0:502", 4, 0, 12}, {"0.0.0.0:502", 0, 1, 3}};
  outputs::OutputList outputs;
  outputs.push_back(std::make_unique<outputs::FakeOutput>("modbus", nullptr, MetricsOf(traffic)));
  outputs.push_back(std::make_unique<outputs::FakeOutput>(
      "dds", nullptr, std::vector<outputs::Series>{outputs::Series(dds::kDdsSamples, 77)}));
  const status::GatewayInfo info{"1.2.3", status::kStarted, &outputs};
  const std::string text = MetricsText(config_, store_, info, kNow);
  for (const char* line : {"baudgate_modbus_requests_total{listener=\"0.0.0.0:502\",function=\"4\","
                           "exception=\"none\"} 12\n",
                           "baudgate_modbus_requests_total{listener=\"0.0.0.0:502\",function="
                           "\"other\",exception=\"1\"} 3\n",
                           "baudgate_dds_samples_total 77\n"}) {
    EXPECT_THAT(text, HasSubstr(line));
  }
}

TEST_F(MetricsTest, LabelsAreEscaped) {
  config_.lines[1].devices[0].points[0].unit = "a\"b\\c\nd";
  Renew(store_, config_);
  const std::array<bus::Sample, 1> samples = {{{0, Value(true), Quality::good}}};
  store_.Update(2, samples, kNow, 20ms);
  EXPECT_THAT(Text(), HasSubstr(R"(point="current",unit="a\"b\\c\nd"} 1)"));
}

TEST_F(MetricsTest, CheckReportsTheMaximumNumberOfSeries) {
  for (std::uint32_t device = 0; device < 3; ++device) {
    status::AddExchanges(store_, device, Outcome::ok, 1, kNow);
    for (std::uint32_t point = 0; point < 2; ++point) {
      const std::array<bus::Sample, 1> samples = {{{point, Value(1.0), Quality::good}}};
      store_.Update(device, samples, kNow, 20ms);
    }
  }
  std::istringstream lines(Text());
  std::size_t series = 0;
  for (std::string line; std::getline(lines, line);) series += line.starts_with('#') ? 0 : 1;
  EXPECT_EQ(series + 4, SeriesOf(config_)) << "no alarms without events, and no outputs";
}

std::string PageOfMetrics() {
  std::ifstream file("docs/metrics.md");
  return {std::istreambuf_iterator<char>(file), {}};
}

TEST(Metrics, TheDocumentationHasTheNumberOfSeries) {
  EXPECT_THAT(
      PageOfMetrics(),
      HasSubstr("each device " + std::to_string(outputs::SeriesIn<bus::DeviceStatus>()) +
                ", each line " + std::to_string(outputs::SeriesIn<bus::LineStatus>()) + "."));
}

TEST_F(MetricsTest, AreAllDocumented) {
  const std::string page = PageOfMetrics();
  FakeEvents events;
  modbus::TrafficStatus traffic;
  traffic.functions = {{"0.0.0.0:502", 4, 0, 12}};
  outputs::OutputList outputs;
  outputs.push_back(std::make_unique<outputs::FakeOutput>("modbus", nullptr, MetricsOf(traffic)));
  outputs.push_back(std::make_unique<outputs::FakeOutput>(
      "dds", nullptr, std::vector<outputs::Series>{outputs::Series(dds::kDdsSamples, 77)}));
  const status::GatewayInfo info{
      .version = "1.2.3",
      .started = status::kStarted,
      .outputs = &outputs,
      .events = &events,
      .certificates = [] {
        return std::vector<status::CertificateEnd>{{"web", WallTime(1'800'000'000s)}};
      }};
  EXPECT_THAT(MetricsText(config_, store_, info, kNow),
              HasSubstr("baudgate_certificate_end_timestamp_seconds{use=\"web\"} 1800000000\n"));
  std::istringstream lines(MetricsText(config_, store_, info, kNow));
  std::size_t metrics = 0;
  for (std::string line, type, seen; std::getline(lines, line);) {
    if (line.starts_with("# TYPE ")) type = line.substr(7);
    if (line.starts_with('#') || std::exchange(seen, type) == type) continue;
    ++metrics;
    const std::size_t blank = type.find(' ');
    std::string row = "| `" + type.substr(0, blank) + "` | " + type.substr(blank + 1) + " | ";
    std::string cell;
    static const std::regex kLabel(R"((\w+)="[^"]*")");
    for (std::sregex_iterator label(line.begin(), line.end(), kLabel), end; label != end; ++label) {
      if ((*label)[1] == "le") continue;
      cell += (cell.empty() ? "`" : ", `") + (*label)[1].str() + "`";
    }
    EXPECT_THAT(page, HasSubstr(row + cell + " |")) << line;
  }
  EXPECT_GE(metrics, 18U);
}

}  // namespace

struct Toy {
  std::uint32_t resets = 7;
  Duration busy = 1500ms;
  std::uint32_t untold = 1;
  bus::RoundTrips trips{};
};

template <typename Visit>
void VisitFields(const Toy*, Visit visit) {
  visit(bus::Counted<&Toy::resets>{.metric = "toy_resets_total", .help = "Resets."});
  visit(bus::NotInJson<&Toy::busy>{.metric = "toy_busy_seconds", .help = "Busy."});
  visit(bus::Counted<&Toy::untold>());
  visit(bus::NotInJson<&Toy::trips>{.metric = "toy_trip_seconds", .help = "Trips."});
}

namespace {

TEST(Families, AreDerivedFromTheRowsOfATable) {
  outputs::Families<Toy> families;
  families.Add(Toy(), "device=\"a\"");
  families.Add({.resets = 8}, "device=\"b\"");
  std::string text;
  for (const outputs::Series& series : families.all()) series.AppendTo(text);
  EXPECT_THAT(text, ::testing::StartsWith("# HELP toy_resets_total Resets.\n"
                                          "# TYPE toy_resets_total counter\n"
                                          "toy_resets_total{device=\"a\"} 7\n"
                                          "toy_resets_total{device=\"b\"} 8\n"
                                          "# HELP toy_busy_seconds Busy.\n"
                                          "# TYPE toy_busy_seconds gauge\n"
                                          "toy_busy_seconds{device=\"a\"} 1.5\n"));
  EXPECT_THAT(text, HasSubstr("# TYPE toy_trip_seconds histogram\n"));
  EXPECT_EQ(outputs::SeriesIn<Toy>(),
            2 + outputs::SeriesIn<bus::LineStatus>() - 1 - bus::kLineUses);
}

/// Fails if a row names a metric but its type has no values: the metric would be missing.
template <typename T>
void ExpectValues() {
  VisitFields(static_cast<const T*>(nullptr), [](auto row) {
    using Member = std::remove_cvref_t<decltype(std::invoke(row.member, T()))>;
    const bool has_values = requires { outputs::EachValue(Member(), outputs::AddValue()); };
    EXPECT_TRUE(row.metric.empty() || has_values) << row.metric;
  });
}

TEST(Families, EveryRowWithAMetricHasValues) {
  ExpectValues<bus::LineStatus>();
  ExpectValues<bus::DeviceStatus>();
  ExpectValues<modbus::RouteStatus>();
}

using status::Json;

struct Example {
  std::string request;  ///< Example: "GET /api/v1/status", "POST /login {…}"
  std::string answer;
};

std::vector<Example> Examples() {
  std::ifstream file("docs/api.md");
  std::vector<Example> examples;
  for (std::string line; std::getline(file, line);) {
    if (line != "```") continue;
    Example& example = examples.emplace_back();
    std::getline(file, example.request);
    for (std::string next; std::getline(file, next) && next != "```";) example.answer += next;
  }
  return examples;
}

std::string Different(const Json& example, const Json& answer, const std::string& at = "") {
  if (example.is_null() || answer.is_null()) return {};
  if (example.is_number() && answer.is_number()) return {};
  if (example.type() != answer.type()) return at + " is another type";
  if (example.is_array()) {
    if (example.empty() || answer.empty()) return example.empty() ? "" : at + " is empty";
    for (std::size_t i = 0; i < std::min(example.size(), answer.size()); ++i) {
      const std::string deep = Different(example[i], answer[i], at + "[]");
      if (!deep.empty()) return deep;
    }
    return {};
  }
  if (!example.is_object()) return {};
  for (const auto& [key, value] : example.items()) {
    if (key == "…") continue;
    if (!answer.contains(key)) return at + " has no " + key;
    const std::string deep = Different(value, answer[key], at + "." + key);
    if (!deep.empty()) return deep;
  }
  for (const auto& [key, value] : answer.items()) {
    if (!example.contains("…") && !example.contains(key)) return at + " has " + key + ", too";
  }
  return {};
}

TEST_F(WebTest, DocumentedExamplesAreAnsweredAsPrinted) {
  FakeEvents events;
  info_.events = &events;
  info_.history = std::make_shared<FakeHistory>();
  info_.reload = [] { return status::ReloadState{}; };
  config_.web.acknowledge = true;
  config_.lines[0].devices[0].points[0].modbus = 0;
  Put(0, 0, 1.25);
  Start();
  const auto examples = Examples();
  EXPECT_GE(examples.size(), 11U);
  for (const Example& example : examples) {
    const std::size_t blank = example.request.find(' ');
    const std::string method = example.request.substr(0, blank);
    const std::string rest = example.request.substr(blank + 1);
    const std::size_t body = rest.find(' ');
    const Reply reply =
        method == "GET" ? Get(rest) : Client().Post(rest.substr(0, body), rest.substr(body + 1));
    const Json expected = Json::parse(example.answer, nullptr, false);
    ASSERT_FALSE(expected.is_discarded()) << example.request;
    const Json answer = Json::parse(reply.body, nullptr, false);
    ASSERT_FALSE(answer.is_discarded()) << example.request << ": " << reply.body;
    EXPECT_EQ(Different(expected, answer), "") << example.request << ": " << reply.body;
    EXPECT_EQ(answer.contains("detail") ? answer["status"] : Json(200), Json(reply.status));
  }
  EXPECT_EQ(events.by, "web:127.0.0.1");
  Stop();
}

TEST_F(WebTest, TheHistoryIsDownloadedPageByPage) {
  info_.history = std::make_shared<FakeHistory>();
  Start();
  Reply reply = Get("/api/v1/history.csv?point=bay-1.feeder-1.current");
  EXPECT_EQ(reply.headers["content-type"], "text/csv; charset=utf-8");
  EXPECT_EQ(reply.headers["content-disposition"],
            "attachment; filename=\"bay-1.feeder-1.current.csv\"");
  EXPECT_THAT(reply.body,
              ::testing::StartsWith(
                  "time_utc,point,value,quality,quality_text,shown\r\n"
                  "2026-09-21 00:00:00.000,bay-1.feeder-1.current,10.0,192,good,10.00\r\n"));
  EXPECT_EQ(std::ranges::count(reply.body, '\n'), 601);
  Stop();
}

TEST_F(WebTest, TheHistoryOfSeveralPointsIsOneTable) {
  info_.history = std::make_shared<FakeHistory>();
  Start();
  const std::string point = "bay-1.feeder-1.current";
  Reply reply = Get("/api/v1/history.csv?point=" + point + "," + point);
  EXPECT_EQ(reply.headers["content-disposition"], "attachment; filename=\"history.csv\"");
  EXPECT_EQ(std::ranges::count(reply.body, '\n'), 1201);
  EXPECT_EQ(reply.body.find("time_utc", 1), std::string::npos) << "one head";
  EXPECT_EQ(Get("/api/v1/history.csv?point=" + point + ",bay-1.feeder-1.none").status, 404);
  EXPECT_EQ(Get("/api/v1/history.csv?point=" + std::string(64, ',')).status, 400);
  Stop();
}

TEST_F(WebTest, EventsAreDownloadedAsATable) {
  FakeEvents events;
  info_.events = &events;
  Start();
  Reply reply = Get("/api/v1/events.csv?kind=message&priority=none&text=ABOVE");
  EXPECT_EQ(reply.headers["content-type"], "text/csv; charset=utf-8");
  EXPECT_THAT(reply.body, ::testing::StartsWith(
                              "seq,receive_time_utc,device_time_utc,clock_quality,line,device,"
                              "channel,code,kind,priority,text\r\n412,"));
  EXPECT_THAT(reply.body,
              ::testing::HasSubstr("bay-1,feeder-1,0,0,message,none,current of feeder-1 is"));
  EXPECT_EQ(events.query.state, config::EventState::message);
  EXPECT_EQ(events.query.text, "ABOVE");
  EXPECT_EQ(events.query.priority, config::AlarmPriority::none);
  EXPECT_EQ(Get("/api/v1/events?priority=urgent").status, 400);
  EXPECT_EQ(Get("/api/v1/events?kind=alarm").status, 400);
  Stop();
}

}  // namespace
}  // namespace baudgate::web
