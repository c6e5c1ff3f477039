// Benchmark of the history: 10,000 points that change every second, then a chart of a year.
// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <cmath>
#include <ctime>
#include <filesystem>
#include <random>

#include "gateway/records/history/history_log.h"
#include "gateway/records/history/history_view.h"
#include "gateway/records/history/recorder.h"
#include "tests/bench/bench.h"

namespace baudgate::bench {
namespace {

using namespace history;

constexpr std::uint32_t kDevices = 100;
constexpr std::uint32_t kPoints = 100;
constexpr int kSeconds = 900;
constexpr double kShareWanted = 0.08;
constexpr double kBytesWanted = 3;

double ProcessorSeconds() {
  timespec time{};
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &time);
  return static_cast<double>(time.tv_sec) + static_cast<double>(time.tv_nsec) / 1e9;
}

config::Config ManyPoints() {
  config::Config config;
  config::Line line;
  line.name = "bench";
  for (std::uint32_t d = 0; d < kDevices; ++d) {
    config::Device device;
    device.name = "d" + std::to_string(d);
    for (std::uint32_t p = 0; p < kPoints; ++p) {
      config::Point point;
      point.name = "p" + std::to_string(p);
      point.type = p % 4 == 0 ? config::Type::boolean : config::Type::float32;
      device.points.push_back(point);
      config.history.points.push_back({.device = d, .point = p, .every = true});
    }
    line.devices.push_back(std::move(device));
  }
  config.lines.push_back(std::move(line));
  return config;
}

class Signal {
 public:
  Value Next(std::uint32_t point, int second) {
    switch (point % 4) {
      case 0:
        return (second / 60 + static_cast<int>(point)) % 7 == 0;
      case 3:
        return static_cast<double>(static_cast<float>(230 + noise_(random_)));
      default:
        level_ += static_cast<int>(random_() % 5) - 2;
        return static_cast<double>(level_ % 5000) * 0.1;
    }
  }

 private:
  std::mt19937 random_{14};
  std::normal_distribution<double> noise_{0, 1};
  int level_ = 2000;
};

struct Kinds {
  double bytes[3] = {};
  double samples[3] = {};
};

void CountChunks(const std::filesystem::path& file, Kinds& kinds) {
  records::Database database(file.string(), records::Database::Mode::read);
  records::Statement rows(
      database,
      "SELECT name, sum(count), sum(length(bytes)) FROM chunks JOIN points USING (point) "
      "GROUP BY name");
  while (rows.Next() == records::Statement::Step::row) {
    const std::string name(rows.Text(0));
    const int point = std::stoi(name.substr(name.rfind('p') + 1));
    const int kind = point % 4 == 0 ? 0 : point % 4 == 3 ? 2 : 1;
    kinds.samples[kind] += rows.Real(1);
    kinds.bytes[kind] += rows.Real(2);
  }
}

void RunManyPoints() {
  const std::filesystem::path folder = Scratch() + "/history";
  std::filesystem::create_directories(folder);
  const config::Config config = ManyPoints();
  bus::PointStore store(config);
  const auto feed = store.Subscribe();
  constexpr Millis kBegin = 1'790'000'000'000 / kDay * kDay + kHour;
  Now now{Instant(1h), ToWall(kBegin)};
  Recorder recorder(config.history, store, now);
  std::vector<PointName> names;
  for (const config::Device& device : config.lines[0].devices) {
    for (const config::Point& point : device.points) {
      names.push_back({"bench." + device.name + "." + point.name, point.type});
    }
  }
  ValueStore files(folder, names, {.bytes = 100'000 * config::kMegabyte});
  if (!files.Open(now)) return;
  Signal signal;
  bus::Changes changes;
  double recording = 0;
  double writing = 0;
  std::vector<bus::Sample> samples;
  for (int second = 0; second < kSeconds; ++second) {
    Batch batch;
    for (std::uint32_t device = 0; device < kDevices; ++device) {
      samples.clear();
      for (std::uint32_t point = 0; point < kPoints; ++point) {
        samples.push_back({point, signal.Next(point, second), Quality::good});
      }
      const auto jitter = std::chrono::microseconds(device * 9000 + device * second % 3000);
      store.Update(device, samples, {now.instant + jitter, now.wall + jitter}, 5ms);
    }
    now = {now.instant + 1s, now.wall + 1s};
    const double begin = ProcessorSeconds();
    feed->Drain({}, changes);
    recorder.Take(changes, now, 1'000'000, batch);
    recorder.Tick(now, 1'000'000, batch);
    const double middle = ProcessorSeconds();
    if (const Status status = files.Write(std::move(batch), now); !status) {
      fmt::print("history: {}\n", status.error());
      return;
    }
    recording += middle - begin;
    writing += ProcessorSeconds() - middle;
  }
  const double begin = ProcessorSeconds();
  now = {now.instant + 2h, now.wall + 2h};
  for (int step = 0; step < 300; ++step) {
    now = {now.instant + 1s, now.wall + 1s};
    files.Write({}, now);
  }
  writing += ProcessorSeconds() - begin;
  const double share = (recording + writing) / kSeconds;
  fmt::print(
      "history: {} points at 1 s, each reading kept: {:.1f} % of a core ({:.1f} % looking "
      "and deciding, {:.1f} % files)  {}\n",
      kDevices * kPoints, share * 100, recording / kSeconds * 100, writing / kSeconds * 100,
      Verdict(share <= kShareWanted));
  Kinds kinds;
  CountChunks(folder / DayFileName(kBegin), kinds);
  const double all = kinds.samples[0] + kinds.samples[1] + kinds.samples[2];
  fmt::print("history: bytes a sample: states {:.2f}, steps of a tenth {:.2f}  {}, noise {:.2f}\n",
             kinds.bytes[0] / kinds.samples[0], kinds.bytes[1] / kinds.samples[1],
             Verdict(kinds.bytes[1] / kinds.samples[1] <= kBytesWanted),
             kinds.bytes[2] / kinds.samples[2]);
  fmt::print("history: the day's file has {:.1f} MB for {:.1f} M samples, trends.db {:.1f} MB\n",
             static_cast<double>(std::filesystem::file_size(folder / DayFileName(kBegin))) / 1e6,
             all / 1e6,
             static_cast<double>(std::filesystem::file_size(folder / kTrendsFile)) / 1e6);
}

void RunYear() {
  const std::filesystem::path folder = Scratch() + "/year";
  std::filesystem::create_directories(folder);
  constexpr int kHours = 8760;
  constexpr std::uint32_t kCharts = 50;
  std::vector<PointName> names;
  for (std::uint32_t i = 0; i < kCharts; ++i) names.push_back({"p" + std::to_string(i)});
  TrendFile file(folder / kTrendsFile, names);
  if (!file.Open().ok) return;
  constexpr Millis kBegin = 1'750'000'000'000 / kDay * kDay;
  for (int hour = 0; hour < kHours; hour += 24) {
    std::vector<TrendRow> rows;
    for (int i = 0; i < 24; ++i) {
      for (std::uint32_t point = 0; point < kCharts; ++point) {
        const double v = std::sin(hour + i + static_cast<double>(point));
        rows.push_back(
            {point, 1, kHour, {kBegin + (hour + i) * kHour, v, v - 1, v + 1, v, v, 3600, kHour}});
      }
    }
    file.Write(rows, {{1, kBegin, kBegin + (hour + 24) * kHour, RunBegin::started}}, std::nullopt);
  }
  std::vector<double> times;
  std::size_t spans = 0;
  for (int round = 0; round < 20; ++round) {
    const double begin = ProcessorSeconds();
    TrendQuery query{.point = "p7", .every = kHour};
    spans = 0;
    for (bool more = true; more;) {
      const auto page = ReadTrends(folder, query);
      if (!page) return;
      spans += page->spans.size();
      query.since = page->next;
      more = page->more;
    }
    times.push_back((ProcessorSeconds() - begin) * 1000);
  }
  fmt::print("history: a year of one point by hours, {} spans: {:.1f} ms of processor time  {}\n",
             spans, Median(times), Verdict(Median(times) < 50));
}

}  // namespace

void RunHistory() {
  RunManyPoints();
  RunYear();
}

}  // namespace baudgate::bench
