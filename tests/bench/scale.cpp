// Benchmark: 10,000 points on 100 pty lines, all changing every second, with one DDS subscriber.
// SPDX-License-Identifier: Apache-2.0
#include <fcntl.h>
#include <fmt/format.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <asio/io_context.hpp>
#include <atomic>
#include <csignal>
#include <filesystem>
#include <fstream>
#include <thread>

#include "gateway/daemon/daemon.h"
#include "gateway/outputs/dds/fast/subscriber.h"
#include "gateway/tools/simulate/simulator.h"
#include "tests/bench/bench.h"

namespace baudgate::bench {
namespace {

constexpr int kDomain = 112;
constexpr int kLines = 100;
constexpr int kPointsPerLine = 100;
constexpr auto kSettle = std::chrono::seconds(8);
constexpr auto kMeasured = std::chrono::seconds(30);
constexpr double kWantedCore = 0.35;
constexpr double kWantedMib = 120;

/// Each line has one relay with a hundred float points. Polling them takes four exchanges a second.
std::string Yaml(const std::string& directory) {
  std::string points;
  for (int i = 1; i <= kPointsPerLine; ++i) {
    points += fmt::format(
        "          - {{ name: v{0}, read: V{0}, type: float32, modbus: {1}, simulate: [0, 100] "
        "}}\n",
        i, 2 * (i - 1));
  }
  std::string yaml = fmt::format(
      "gateway: {{ name: scale }}\nmodbus: {{ listen: \"127.0.0.1:15999\" }}\n"
      "dds: {{ domain: {} }}\nlines:\n",
      kDomain);
  for (int line = 0; line < kLines; ++line) {
    yaml += fmt::format(
        "  - name: line{0}\n    port: {1}/{0}\n    protocol: spabus\n    devices:\n"
        "      - name: relay{0}\n        address: 1\n        unit: {2}\n        poll: 1s\n"
        "        max_items: 25\n        points:\n",
        line, directory, line + 1);
    yaml += points;
  }
  return yaml;
}

pid_t Spawn(const std::string& self, const char* role, const std::string& argument) {
  const pid_t child = fork();
  if (child != 0) return child;
  execl(self.c_str(), "baudgate_bench", role, argument.c_str(), nullptr);
  _exit(127);
}

void End(pid_t child) {
  kill(child, SIGTERM);
  waitpid(child, nullptr, 0);
}

double CpuSeconds() {
  rusage used{};
  getrusage(RUSAGE_SELF, &used);
  const auto seconds = [](const timeval& time) {
    return static_cast<double>(time.tv_sec) + static_cast<double>(time.tv_usec) / 1e6;
  };
  return seconds(used.ru_utime) + seconds(used.ru_stime);
}

double ResidentMib() {
  std::ifstream status("/proc/self/status");
  for (std::string line; std::getline(status, line);) {
    if (line.starts_with("VmRSS:")) return std::stod(line.substr(6)) / 1024;
  }
  return 0;
}

}  // namespace

int BeScaleTwins(const config::Catalog& catalog, int argc, char** argv) {
  if (argc < 1) return 2;
  const auto config = Load(Yaml(argv[0]), catalog);
  asio::io_context io(1);
  std::vector<std::unique_ptr<tools::Simulator>> twins;
  for (const config::Line& line : config.lines) {
    tools::SimulatorOptions options;
    options.link = line.port;
    auto twin =
        tools::Simulator::Create(io, *catalog.FindProtocol("spabus"), line.devices, options);
    if (!twin) return 4;
    twins.push_back(std::move(*twin));
  }
  std::ofstream(std::string(argv[0]) + "/ready");
  io.run();
  return 0;
}

int BeScaleSubscriber(int argc, char** argv) {
  if (argc < 1) return 2;
  std::atomic<std::uint64_t> samples = 0;
  dds::SubscriberOptions options;
  options.participant.domain = kDomain;
  dds::SubscriberCallbacks callbacks;
  callbacks.on_point = [&](const dds::PointSample&, const dds::Origin&) { ++samples; };
  const auto subscriber = dds::DdsSubscriber::Create(options, callbacks);
  if (!subscriber) return 4;
  while (true) {
    std::this_thread::sleep_for(std::chrono::milliseconds(200));
    std::ofstream(std::string(argv[0]) + "/samples.new") << samples << "\n";
    std::filesystem::rename(std::string(argv[0]) + "/samples.new",
                            std::string(argv[0]) + "/samples");
  }
}

void RunScale(const config::Catalog& catalog, const std::string& self) {
  fmt::print("scale: {} points on {} pty lines at 1 s, every value changing, one DDS subscriber\n",
             kLines * kPointsPerLine, kLines);
  const std::string directory = Scratch() + "/scale";
  std::filesystem::create_directory(directory);
  const pid_t twins = Spawn(self, "be-scale-twins", directory);
  const pid_t subscriber = Spawn(self, "be-scale-subscriber", directory);
  while (!std::filesystem::exists(directory + "/ready")) {
    std::this_thread::sleep_for(std::chrono::milliseconds(50));
  }
  const auto seen = [&] {
    std::uint64_t samples = 0;
    std::ifstream(directory + "/samples") >> samples;
    return samples;
  };
  {
    daemon::Daemon daemon(Load(Yaml(directory), catalog), catalog);
    if (const Status status = daemon.Start(); !status) {
      fmt::print(stderr, "{}\n", status.error());
      std::exit(4);
    }
    std::this_thread::sleep_for(kSettle);
    const Totals before = Sum(daemon.store());
    const std::uint64_t seen_before = seen();
    const double cpu_before = CpuSeconds();
    std::this_thread::sleep_for(kMeasured);
    const double cpu =
        (CpuSeconds() - cpu_before) / std::chrono::duration<double>(kMeasured).count();
    const Totals after = Sum(daemon.store());
    const double mib = ResidentMib();
    fmt::print(
        "  {:.0f} points and {:.0f} exchanges a second, {} failed, {:.0f} samples a second at the "
        "subscriber\n",
        static_cast<double>(after.readings - before.readings) / 30,
        static_cast<double>(after.exchanges - before.exchanges) / 30, after.failed - before.failed,
        static_cast<double>(seen() - seen_before) / 30);
    fmt::print("  missed periods: {}  {}\n", after.missed - before.missed,
               Verdict(after.missed == before.missed));
    fmt::print("  processor: {:.1f} % of one core (wanted: below {:.0f} %)  {}\n", 100 * cpu,
               100 * kWantedCore, Verdict(cpu < kWantedCore));
    fmt::print("  resident: {:.0f} MiB (wanted: below {:.0f})  {}\n", mib, kWantedMib,
               Verdict(mib < kWantedMib));
    daemon.Stop();
  }
  End(twins);
  End(subscriber);
}

}  // namespace baudgate::bench
