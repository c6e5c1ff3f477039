// Benchmark: how much dead devices slow living ones, and how soon a port that comes back is served.
// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <algorithm>
#include <asio/io_context.hpp>
#include <asio/post.hpp>
#include <asio/use_future.hpp>
#include <memory>
#include <thread>

#include "gateway/lines/line_runner.h"
#include "gateway/tools/simulate/simulator.h"
#include "tests/bench/bench.h"
#include "transports/loop_thread.h"

namespace baudgate::bench {
namespace {

constexpr int kLiving = 5;
constexpr int kDead[] = {0, 1, 10, 30};
constexpr std::size_t kLines = std::size(kDead);
constexpr Duration kSettle = 40s;  // in this time, thirty dead devices are asked at least once each
constexpr Duration kMeasured = 120s;
constexpr double kWanted = 0.97;

constexpr int kReturns = 8;
constexpr Duration kWantedReturn = 1500ms;

std::string LineYaml(const std::string& port, int living, int dead) {
  std::string yaml = fmt::format(
      "  - name: {0}\n    port: {1}/{0}\n    serial: 9600 7E1\n    protocol: spabus\n    "
      "devices:\n",
      port, Scratch());
  for (int i = 0; i < living + dead; ++i) {
    yaml += fmt::format("      - {{ name: {}-{}, address: {}, profile: spaj140c, poll: 10ms }}\n",
                        port, i, i + 1);
  }
  return yaml;
}

/// Runs lines as the gateway does. Each line has a simulator of its first devices; the other
/// devices are dead.
class Lines {
 public:
  Lines(const std::string& yaml, const config::Catalog& catalog)
      : protocol_(*catalog.FindProtocol("spabus")),
        config_(
            Load("modbus: { enabled: false }\ndds: { enabled: false }\nlines:\n" + yaml, catalog)),
        store_(config_),
        twins_(config_.lines.size()),
        thread_([this] { world_.run(); }) {
    std::uint32_t first = 0;
    for (const config::Line& line : config_.lines) {
      loops_.push_back(std::make_unique<transports::LoopThread>("line " + line.name));
      loops_.back()->Start();
      runners_.push_back(std::make_unique<lines::LineRunner>(
          loops_.back()->io(), store_.line(first), first,
          [this](const std::string&) -> const protocols::Protocol& { return protocol_; }, store_));
      first += static_cast<std::uint32_t>(line.devices.size());
    }
  }
  ~Lines() {
    for (const auto& runner : runners_) runner->Stop();
    world_.stop();
    thread_.join();
  }

  void StartTwins(std::size_t line) {
    const config::Line& its = config_.lines[line];
    tools::SimulatorOptions options;
    options.link = its.port;
    options.pace = its.serial;
    auto twins = tools::Simulator::Create(
        world_, protocol_, {its.devices.begin(), its.devices.begin() + kLiving}, options);
    twins_[line] = std::move(*twins);
  }
  void StopTwins(std::size_t line) {
    asio::post(world_, asio::use_future([&] { twins_[line].reset(); })).wait();
  }
  void StartRunners() {
    for (const auto& runner : runners_) runner->Start();
  }
  std::uint64_t answered(std::size_t line) const { return twins_[line]->answered(); }

 private:
  const protocols::Protocol& protocol_;
  const config::Config config_;
  bus::PointStore store_;
  asio::io_context world_{1};
  asio::executor_work_guard<asio::io_context::executor_type> work_{world_.get_executor()};
  std::vector<std::unique_ptr<tools::Simulator>> twins_;
  std::vector<std::unique_ptr<transports::LoopThread>> loops_;
  std::vector<std::unique_ptr<lines::LineRunner>> runners_;
  std::thread thread_;
};

void MeasureDead(const config::Catalog& catalog) {
  fmt::print("dead devices beside {} living, SPA 9600 7E1 (wanted: {:.2f} of the rate without)\n",
             kLiving, kWanted);
  std::string yaml;
  for (const int dead : kDead) yaml += LineYaml(fmt::format("dead{}", dead), kLiving, dead);
  Lines lines(yaml, catalog);
  for (std::size_t line = 0; line < kLines; ++line) lines.StartTwins(line);
  lines.StartRunners();
  std::this_thread::sleep_for(kSettle);
  std::uint64_t before[kLines];
  for (std::size_t line = 0; line < kLines; ++line) before[line] = lines.answered(line);
  std::this_thread::sleep_for(kMeasured);
  const auto rate = [&](std::size_t line) {
    return static_cast<double>(lines.answered(line) - before[line]);
  };
  const double alone = rate(0);
  for (std::size_t line = 0; line < kLines; ++line) {
    const double share = rate(line) / alone;
    fmt::print("  {:>2} dead: {:>5.0f} exchanges with the living in {:.0f} s: {:.4f}  {}\n",
               kDead[line], rate(line), std::chrono::duration<double>(kMeasured).count(), share,
               Verdict(share >= kWanted));
  }
}

void MeasureReturn(const config::Catalog& catalog) {
  fmt::print("a port that returns, {} times (wanted: served within {})\n", kReturns,
             FormatDuration(kWantedReturn));
  Lines lines(LineYaml("returning", kLiving, 0), catalog);
  lines.StartRunners();
  std::vector<double> waits;
  for (int i = 0; i < kReturns; ++i) {
    std::this_thread::sleep_for(300ms + i * 700ms);  // the device is absent for longer each time
    lines.StartTwins(0);
    const auto began = std::chrono::steady_clock::now();
    while (lines.answered(0) == 0) std::this_thread::sleep_for(1ms);
    waits.push_back(
        std::chrono::duration<double>(std::chrono::steady_clock::now() - began).count());
    std::this_thread::sleep_for(500ms);
    lines.StopTwins(0);
  }
  const double longest = *std::max_element(waits.begin(), waits.end());
  fmt::print("  first answer after {:.3f} s in the median, {:.3f} s at the longest  {}\n",
             Median(waits), longest,
             Verdict(longest <= std::chrono::duration<double>(kWantedReturn).count()));
}

}  // namespace

void RunDeadDevices(const config::Catalog& catalog) {
  MeasureDead(catalog);
  MeasureReturn(catalog);
}

}  // namespace baudgate::bench
