// Tests remote write with real receivers. They and the gateway are killed, and at the end the
// receiver has each stored value exactly once.
// SPDX-License-Identifier: Apache-2.0
#include <gmock/gmock.h>

#include <cmath>
#include <csignal>
#include <map>
#include <string>

#include "gateway/base/time.h"
#include "tests/system/station.h"

namespace baudgate::system_test {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

/// The good values of a point by time, in ms since 1970.
using Values = std::map<std::int64_t, double>;

class RemoteWrite : public Station {
 protected:
  std::string Yaml(const std::string& url) const {
    return "history: { max_gap: 1s, points: [ 'bay.*.current_l*' ] }\n"
           "remote_write: { url: '" +
           url + "', labels: { site: north } }\n" +
           WithSocket(Head(), "state: " + LinkOf("state") + ", ") +
           Line("bay", "spabus", "address: 1, unit: 1, profile: spaj140c, poll: 50ms");
  }
  std::string UrlOf(const std::string& path) const {
    return "http://127.0.0.1:" + std::to_string(receiver_port_) + path;
  }
  std::string Fetch(const std::string& path) const {
    return RunToEnd({"curl", "-s", "-g", "-m", "10", UrlOf(path)}, directory()).output;
  }
  std::unique_ptr<Child> StartRelay() const {
    return StartTwin("bay", "spaj140c", "1", {"--think", "1ms"});
  }
  static void Kill(std::unique_ptr<Child>& process, int signal = SIGKILL) {
    process->Signal(signal);
    process->WaitForEnd();
    process.reset();
  }
  /// The good values that the gateway has stored up to `until`.
  Values Stored(const std::string& point, WallTime until) const {
    Values values;
    const auto rows = JsonLines(
        Ask({"history", "bay.bay-1." + point, "--until", FormatWallTime(until), "--json"}).output);
    for (const Json& row : rows) {
      if (row.contains("gap") || row["quality"] != 192) continue;
      values[MillisOf(*ParseWallTime(row["time"].get<std::string>()))] = row["value"];
    }
    return values;
  }
  static std::int64_t MillisOf(WallTime time) {
    return std::chrono::floor<std::chrono::milliseconds>(time).time_since_epoch().count();
  }
  Json Section() const { return Status()["remote_write"]; }

  /// Outages of both sides; `signal` ends the receiver. `start` starts the receiver, `read` returns
  /// what it has of a point and counts repetitions.
  template <typename Start, typename Read>
  void CheckThatNothingIsLost(const std::string& path, int signal, Start start, Read read) {
    const auto relay = StartRelay();
    auto daemon = StartDaemon(Yaml(UrlOf(path)));
    ASSERT_TRUE(Eventually([&] {
      return Section()["advice"].dump().find("cannot be reached") != std::string::npos;
    })) << Section().dump();
    std::unique_ptr<Child> receiver = start();
    ASSERT_TRUE(Eventually([&] { return Section()["confirmed"] > 10; })) << Section().dump();
    for (int rounds = signal == SIGKILL ? 2 : 1; rounds > 0; --rounds) {
      Kill(daemon);
      daemon = StartDaemon(Yaml(UrlOf(path)));
      ASSERT_TRUE(Eventually([&] { return Section()["confirmed"] > 10; })) << Section().dump();
      Kill(receiver, signal);
      std::this_thread::sleep_for(500ms);
      receiver = start();
    }
    const WallTime end = ReadClocks().wall;
    for (const std::string point : {"current_l1", "current_l2"}) {
      const auto has_all = [&] {
        const Values there = read(point);
        return !there.empty() && there.rbegin()->first > MillisOf(end);
      };
      ASSERT_TRUE(Eventually(has_all, 3 * kPatience)) << Section().dump();
      Values there = read(point);
      there.erase(there.upper_bound(MillisOf(end) - 1), there.end());
      Values stored = Stored(point, end);
      stored.erase(stored.upper_bound(MillisOf(end) - 1), stored.end());
      EXPECT_GT(stored.size(), 10U);
      EXPECT_EQ(there, stored) << point;
    }
    EXPECT_EQ(Section()["refused"], 0);
    EXPECT_EQ(Section()["gaps"], 0);
  }

  const std::uint16_t receiver_port_ = FreePort();
};

TEST_F(RemoteWrite, PrometheusHasEachValueOnce) {
  Write("prometheus.yaml", "scrape_configs: []\n");
  const auto start = [&] {
    return std::make_unique<Child>(
        std::vector<std::string>{
            "prometheus", "--config.file=prometheus.yaml", "--web.enable-remote-write-receiver",
            "--storage.tsdb.path=" + LinkOf("tsdb"),
            "--web.listen-address=127.0.0.1:" + std::to_string(receiver_port_)},
        directory());
  };
  Json labels;
  const auto read = [&](const std::string& point) {
    Values values;
    const Json json =
        Json::parse(Fetch("/api/v1/query?query=baudgate_point_value{point=\"" + point + "\"}[1h]"),
                    nullptr, false);
    if (json.is_discarded() || json["status"] != "success") return values;
    EXPECT_LE(json["data"]["result"].size(), 1U);
    for (const Json& series : json["data"]["result"]) {
      labels = series["metric"];
      for (const Json& sample : series["values"]) {
        values[std::llround(sample[0].get<double>() * 1000)] =
            std::stod(sample[1].get<std::string>());
      }
    }
    return values;
  };
  CheckThatNothingIsLost("/api/v1/write", SIGKILL, start, read);
  EXPECT_EQ(labels["gateway"], gateway());
  EXPECT_EQ(labels["line"], "bay");
  EXPECT_EQ(labels["device"], "bay-1");
  EXPECT_EQ(labels["unit"], "xIn");
  EXPECT_EQ(labels["site"], "north");
}

TEST_F(RemoteWrite, VictoriaMetricsHasEachValueOnce) {
  const auto start = [&] {
    return std::make_unique<Child>(
        std::vector<std::string>{"victoria-metrics", "-storageDataPath=" + LinkOf("tsdb"),
                                 "-dedup.minScrapeInterval=1ms",
                                 "-httpListenAddr=127.0.0.1:" + std::to_string(receiver_port_)},
        directory());
  };
  const auto read = [&](const std::string& point) {
    Values values;
    Fetch("/internal/force_flush");
    std::string rows = Fetch(
        "/api/v1/export?reduce_mem_usage=0&match[]=baudgate_point_value{point=\"" + point + "\"}");
    // A staleness marker is shown as NaN, which JSON does not know.
    for (std::size_t at = 0; (at = rows.find("NaN", at)) != std::string::npos;) {
      rows.replace(at, 3, "null");
    }
    for (const Json& series : JsonLines(rows)) {
      for (std::size_t i = 0; i < series["values"].size(); ++i) {
        if (!series["values"][i].is_number()) continue;
        const bool is_new =
            values.emplace(series["timestamps"][i].get<std::int64_t>(), series["values"][i]).second;
        EXPECT_TRUE(is_new);
      }
    }
    return values;
  };
  // After SIGKILL, this receiver lacks values of some seconds that it has confirmed.
  CheckThatNothingIsLost("/api/v1/write", SIGTERM, start, read);
}

/// The receiver does not take remote write, or is no receiver: one sentence each.
TEST_F(RemoteWrite, TellsWhatIsWrong) {
  Write("prometheus.yaml", "scrape_configs: []\n");
  const Child prometheus(
      {"prometheus", "--config.file=prometheus.yaml", "--storage.tsdb.path=" + LinkOf("tsdb"),
       "--web.listen-address=127.0.0.1:" + std::to_string(receiver_port_)},
      directory());
  const auto relay = StartRelay();
  const auto daemon = StartDaemon(Yaml(UrlOf("/api/v1/write")));
  const auto tells = [&](const std::string& text) {
    return Eventually([&] { return Section()["advice"].dump().find(text) != std::string::npos; });
  };
  EXPECT_TRUE(tells("nothing takes remote write")) << Section().dump();
  EXPECT_THAT(Ask({"status"}).output, HasSubstr("nothing takes remote write"));
  const auto change = [&](const std::string& url) {
    Write("baudgate.yaml", Yaml(url));
    EXPECT_EQ(Ask({"reload"}).code, 0);
  };
  change("https://127.0.0.1:" + std::to_string(receiver_port_) + "/api/v1/write");
  EXPECT_TRUE(tells("cannot be reached")) << Section().dump();
  change("http://no-such-host.invalid/api/v1/write");
  EXPECT_TRUE(tells("cannot be resolved")) << Section().dump();
}

}  // namespace
}  // namespace baudgate::system_test
