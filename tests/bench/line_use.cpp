// Benchmark: how many of the possible exchanges a line carries, once without outputs and once with
// all outputs switched on.
// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <asio/io_context.hpp>
#include <thread>

#include "gateway/daemon/daemon.h"
#include "gateway/tools/simulate/simulator.h"
#include "tests/bench/bench.h"

namespace baudgate::bench {
namespace {

constexpr Duration kThink = 5ms;
constexpr Duration kEvent = 230ms;
constexpr Duration kWarmUp = 2s;
constexpr Duration kMeasured = 10s;
constexpr double kWanted = 0.97;

struct Case {
  const char* protocol;
  const char* serial;
  const char* profile;
};

constexpr Case kCases[] = {{"spabus", "9600 7E1", "spaj140c"},
                           {"dcon", "9600 8N1", "owen-mv110-8a"},
                           {"dcon", "115200 8N1", "owen-mv110-8a"},
                           {"telegram", "115200 8N1", "owen-mv110-8a-telegrams"},
                           {"set4tm", "9600 8O1", "set-4tm.03m"}};

constexpr const char* kLineAlone =
    "gateway: { name: bench-line }\nmodbus: { enabled: false }\ndds: { enabled: false }\n";

std::string AllOn() {
  return fmt::format(
      "gateway: {{ name: bench-line, state: {0}/state }}\nmodbus: {{ listen: \"127.0.0.1:15299\" "
      "}}\n"
      "dds: {{ domain: 114 }}\nevents: {{}}\n"
      "history: {{ points: [ {{ match: \"*.*.*\", log: all }} ] }}\n",
      Scratch());
}

void RunOne(const Case& one, bool all_on, const config::Catalog& catalog) {
  const std::string port = Scratch() + "/line";
  const auto config = Load(
      fmt::format("{}lines:\n"
                  "  - name: line\n    port: {}\n    serial: {}\n    protocol: {}\n    devices:\n"
                  "      - {{ name: d, address: 1, profile: {}, poll: 10ms, slow: 1h }}\n",
                  all_on ? AllOn() : kLineAlone, port, one.serial, one.protocol, one.profile),
      catalog);
  const config::Line& line = config.lines.front();
  const protocols::Protocol& protocol = *catalog.FindProtocol(one.protocol);

  asio::io_context world(1);
  tools::SimulatorOptions options;
  options.link = port;
  options.pace = line.serial;
  options.think_time = kThink;
  if (all_on) options.events = tools::EventSchedule{.every = kEvent};
  auto twin = tools::Simulator::Create(world, protocol, line.devices, options);
  std::thread world_thread([&] { world.run(); });

  daemon::Daemon daemon(config, catalog);
  if (!daemon.Start()) std::exit(4);
  std::this_thread::sleep_for(kWarmUp);
  const auto began = std::chrono::steady_clock::now();
  const std::uint64_t characters_before = (*twin)->characters();
  const std::uint64_t answered_before = (*twin)->answered();
  std::this_thread::sleep_for(kMeasured);
  const Duration elapsed = std::chrono::steady_clock::now() - began;
  const std::uint64_t characters = (*twin)->characters() - characters_before;
  const std::uint64_t exchanges = (*twin)->answered() - answered_before;
  daemon.Stop();
  world.stop();
  world_thread.join();

  const config::Timing timing = Merge(line.devices.front().timing, protocol.timing(line.serial));
  const Duration needed = static_cast<std::int64_t>(characters) * line.serial.CharacterTime() +
                          static_cast<std::int64_t>(exchanges) * (kThink + *timing.quiet);
  const double share = static_cast<double>(needed.count()) / static_cast<double>(elapsed.count());
  fmt::print(
      "  {:<8} {:<11} {:<6} {:>6} exchanges in {:.1f} s, quiet {:>6}: {:.4f} of the limit  {}\n",
      one.protocol, one.serial, all_on ? "all on" : "alone", exchanges,
      std::chrono::duration<double>(elapsed).count(), FormatDuration(*timing.quiet), share,
      Verdict(share >= kWanted));
}

}  // namespace

void RunLineUse(const config::Catalog& catalog) {
  fmt::print("line use (wanted: {:.2f} of what characters, think time and silences allow)\n",
             kWanted);
  for (const Case& one : kCases) {
    for (const bool all_on : {false, true}) RunOne(one, all_on, catalog);
  }
}

}  // namespace baudgate::bench
