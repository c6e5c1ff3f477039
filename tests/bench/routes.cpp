// Benchmark of transparent routes against minimal programs: round trips, rate, silences, fairness.
// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>
#include <poll.h>
#include <sys/prctl.h>
#include <unistd.h>

#include <algorithm>
#include <asio/io_context.hpp>
#include <atomic>
#include <memory>
#include <optional>
#include <thread>

#include "gateway/daemon/daemon.h"
#include "gateway/tools/simulate/simulator.h"
#include "tests/bench/bare_gateway.h"
#include "tests/bench/bench.h"
#include "tests/support/raw_client.h"

namespace baudgate::bench {
namespace {

using Clock = std::chrono::steady_clock;

constexpr int kRounds = 9;
constexpr int kPerRound = 400;
constexpr Duration kMeasured = 3s;
constexpr double kWantedRoundTrip = 2.0;
/// At its shortest pause, mbusd 0.5.3 carried 700 requests per second, and a bare gateway 7,800 on
/// the same machine. The limit is five times mbusd's share of the bare gateway's rate.
constexpr double kWantedRate = 5 * 700.0 / 7800;
constexpr double kWantedSilence = 150;  // us
constexpr int kClients = 64;
constexpr double kWantedFairness = 0.8;
constexpr double kWantedHigh = 0.5;
constexpr std::size_t kReplyFrame = 7;
constexpr std::uint16_t kFrequency = 200;

std::uint16_t FreePort() { return BareGateway("/dev/null").port(); }

struct Gateway {
  Gateway(const std::string& path, const std::string& serial, const std::string& more,
          const config::Catalog& catalog, const std::string& listen = {})
      : port(FreePort()), high_port(FreePort()) {
    const std::string yaml = fmt::format(
        "dds: {{ enabled: false }}\nmodbus:\n  listen:\n"
        "    - {{ at: \"127.0.0.1:{}\"{} }}\n"
        "    - {{ at: \"127.0.0.1:{}\", priority: high }}\n"
        "  routes: [ {{ units: \"20\", line: drive }} ]\n"
        "lines:\n  - {{ name: drive, port: {}, serial: {}, protocol: modbus_rtu{} }}\n",
        port, listen, high_port, path, serial, more);
    daemon = std::make_unique<daemon::Daemon>(Load(yaml, catalog), catalog);
    if (const Status status = daemon->Start(); !status) {
      fmt::print(stderr, "{}\n", status.error());
      std::exit(4);
    }
    // The line opens in another thread, so the first requests can fail.
    RawClient client(port);
    for (int i = 0; i < 100; ++i) {
      client.Send(ReadAdu(1, kFrequency));
      const Bytes reply = client.ReceiveFrame();
      if (reply.size() == 11) return;
      std::this_thread::sleep_for(20ms);
    }
    fmt::print(stderr, "the route does not answer\n");
    std::exit(4);
  }

  std::uint16_t port;
  std::uint16_t high_port;
  std::unique_ptr<daemon::Daemon> daemon;
};

double Microseconds(Duration time) {
  return std::chrono::duration<double, std::micro>(time).count();
}

std::vector<double> TimeClient(const RawClient& client, int count, Duration pause = {}) {
  std::vector<double> times;
  for (int i = 0; i < count; ++i) {
    const auto began = Clock::now();
    client.Send(ReadAdu(static_cast<std::uint16_t>(i), kFrequency));
    if (client.ReceiveFrame().size() != 11) std::exit(4);
    times.push_back(Microseconds(Clock::now() - began));
    if (pause > Duration::zero()) std::this_thread::sleep_for(pause);
  }
  return times;
}

std::vector<double> TimeMaster(int tty, int count, Duration quiet = {}) {
  std::vector<double> times;
  std::uint8_t reply[kReplyFrame];
  for (int i = 0; i < count; ++i) {
    const auto began = Clock::now();
    if (quiet > Duration::zero()) std::this_thread::sleep_until(began + quiet);
    const Bytes frame = ReadFrame(kFrequency);
    if (write(tty, frame.data(), frame.size()) < 0) std::exit(4);
    if (!ReadWhole(tty, reply, sizeof reply)) std::exit(4);
    times.push_back(Microseconds(Clock::now() - began));
  }
  return times;
}

double Rate(std::uint16_t port, int clients) {
  std::vector<RawClient> all;
  std::vector<pollfd> ready;
  for (int i = 0; i < clients; ++i) {
    all.emplace_back(port);
    ready.push_back({all.back().socket(), POLLIN, 0});
  }
  // Each request has another address, because requests with equal addresses would share one
  // exchange.
  std::uint16_t address = 0;
  for (const RawClient& client : all) client.Send(ReadAdu(1, address++));
  std::uint64_t answered = 0;
  const auto began = Clock::now();
  while (Clock::now() - began < kMeasured) {
    if (poll(ready.data(), ready.size(), 1000) <= 0) std::exit(4);
    for (std::size_t i = 0; i < all.size(); ++i) {
      if ((ready[i].revents & POLLIN) == 0) continue;
      if (all[i].ReceiveFrame().size() != 11) std::exit(4);
      ++answered;
      all[i].Send(ReadAdu(1, address++));
    }
  }
  const double seconds = std::chrono::duration<double>(Clock::now() - began).count();
  for (const RawClient& client : all) client.ReceiveFrame();
  return static_cast<double>(answered) / seconds;
}

void MeasureRoundTrip(const config::Catalog& catalog) {
  ScriptedSlave direct_slave({}, InstantAnswer);
  ScriptedSlave routed_slave({}, InstantAnswer);
  ScriptedSlave bare_slave({}, InstantAnswer);
  const int tty = OpenRaw(direct_slave.path());
  const BareGateway bare(bare_slave.path());
  const Gateway gateway(routed_slave.path(), "921600 8N1", ", timing: { quiet: 0ms }", catalog);
  const RawClient bare_client(bare.port());
  const RawClient client(gateway.port);
  std::vector<double> direct, through_bare, routed, ratios;
  for (int round = 0; round < kRounds; ++round) {
    const auto first = TimeMaster(tty, kPerRound);
    const auto second = TimeClient(bare_client, kPerRound);
    const auto third = TimeClient(client, kPerRound);
    direct.push_back(Median(first));
    through_bare.push_back(Median(second));
    routed.push_back(Median(third));
    ratios.push_back(Median(third) / Median(first));
  }
  close(tty);
  const double ratio = Median(ratios);
  fmt::print(
      "round trip of one register, slave at once, quiet 0 (wanted: <= {:.1f} x the pty alone)\n",
      kWantedRoundTrip);
  fmt::print("  pty alone, bare master:    {:.0f} us\n", Median(direct));
  fmt::print("  bare gateway, TCP client:  {:.0f} us\n", Median(through_bare));
  fmt::print(
      "  route, TCP client:         {:.0f} us, {:.2f} x the pty, {:.2f} x the bare gateway  {}\n",
      Median(routed), ratio, Median(routed) / Median(through_bare),
      Verdict(ratio <= kWantedRoundTrip));
  fmt::print("requests per second (wanted: >= {:.2f} of the bare gateway, 5 x mbusd)\n",
             kWantedRate);
  for (const int clients : {1, 10, kClients}) {
    const double limit = Rate(bare.port(), clients);
    const double ours = Rate(gateway.port, clients);
    fmt::print("  {:>2} clients: {:.0f}/s, bare gateway {:.0f}/s: {:.2f}  {}\n", clients, ours,
               limit, ours / limit, Verdict(ours / limit >= kWantedRate));
  }
}

class PacedSlave {
 public:
  explicit PacedSlave(const config::Catalog& catalog) {
    config::SerialSettings serial;
    serial.baud = 19200;
    serial.parity = config::Parity::even;
    tools::SimulatorOptions options;
    options.pace = serial;
    const std::string yaml =
        "modbus: { enabled: false }\ndds: { enabled: false }\nlines:\n  - { name: drive, port: "
        "/dev/null, serial: 19200 8E1, protocol: modbus_rtu, devices: [ { name: drive, address: "
        "20, profile: mitsubishi-fr-d700 } ] }\n";
    config_ = Load(yaml, catalog);
    auto twins = tools::Simulator::Create(world_, *catalog.FindProtocol("modbus_rtu"),
                                          config_.lines[0].devices, options);
    if (!twins) std::exit(4);
    twins_ = std::move(*twins);
    thread_ = std::thread([this] {
      prctl(PR_SET_TIMERSLACK, 1UL);
      world_.run();
    });
  }
  ~PacedSlave() {
    world_.stop();
    thread_.join();
  }
  const std::string& path() const { return twins_->path(); }

 private:
  config::Config config_;
  asio::io_context world_{1};
  asio::executor_work_guard<asio::io_context::executor_type> work_{world_.get_executor()};
  std::unique_ptr<tools::Simulator> twins_;
  std::thread thread_;
};

void MeasureSilences(const config::Catalog& catalog) {
  PacedSlave direct_slave(catalog);
  PacedSlave routed_slave(catalog);
  const int tty = OpenRaw(direct_slave.path());
  const Gateway gateway(routed_slave.path(), "19200 8E1", "", catalog);
  const RawClient client(gateway.port);
  config::SerialSettings serial;
  serial.baud = 19200;
  serial.parity = config::Parity::even;
  const Duration quiet = std::chrono::nanoseconds(7 * serial.CharacterTime().count() / 2);
  prctl(PR_SET_TIMERSLACK, 1UL);
  std::vector<double> direct, routed;
  for (int round = 0; round < kRounds; ++round) {
    const auto first = TimeMaster(tty, 40, quiet);
    const auto second = TimeClient(client, 40);
    direct.insert(direct.end(), first.begin(), first.end());
    routed.insert(routed.end(), second.begin(), second.end());
  }
  close(tty);
  const double added = Median(routed) - Median(direct);
  fmt::print(
      "19200 8E1, silences of 3.5 characters, one request after the other (wanted: <= {:.0f} us "
      "beyond a bare master)\n",
      kWantedSilence);
  fmt::print("  bare master on the same slave: {:.0f} us; route: {:.0f} us; added {:.0f} us  {}\n",
             Median(direct), Median(routed), added, Verdict(added <= kWantedSilence));
}

/// Returns the number of answered requests of each client. `watched`: counts only between the first
/// and the last answer of this client.
std::vector<std::uint64_t> Share(const std::vector<std::uint16_t>& ports,
                                 std::optional<std::size_t> watched = {}) {
  std::vector<RawClient> all;
  std::vector<pollfd> ready;
  for (const std::uint16_t port : ports) {
    all.emplace_back(port);
    ready.push_back({all.back().socket(), POLLIN, 0});
  }
  std::uint16_t address = 0;
  std::vector<std::uint64_t> answered(all.size());
  std::vector<std::uint64_t> until_watched;
  for (const RawClient& client : all) client.Send(ReadAdu(1, address++));
  const auto began = Clock::now();
  while (Clock::now() - began < kMeasured) {
    if (poll(ready.data(), ready.size(), 1000) <= 0) std::exit(4);
    for (std::size_t i = 0; i < all.size(); ++i) {
      if ((ready[i].revents & POLLIN) == 0) continue;
      if (all[i].ReceiveFrame().size() != 11) std::exit(4);
      if (watched == i && answered[i] == 0) std::ranges::fill(answered, 0);
      ++answered[i];
      if (watched == i) until_watched = answered;
      all[i].Send(ReadAdu(1, address++));
    }
  }
  for (const RawClient& client : all) client.ReceiveFrame();
  return watched ? until_watched : answered;
}

void MeasureFairness(const config::Catalog& catalog) {
  const ScriptedSlave slave({}, InstantAnswer);
  // At 115200 bit/s, a request takes about a millisecond, so clients wait only for the line.
  const Gateway gateway(slave.path(), "115200 8N1", ", timing: { quiet: 1ms }", catalog);
  fmt::print(
      "{} clients on one line (wanted: nobody below {:.0f} % of a fair share; one of high "
      "priority gets {:.0f} %)\n",
      kClients, 100 * kWantedFairness, 100 * kWantedHigh);
  const auto equal = Share(std::vector<std::uint16_t>(kClients, gateway.port));
  double sum = 0;
  for (const std::uint64_t count : equal) sum += static_cast<double>(count);
  const double least = static_cast<double>(*std::ranges::min_element(equal)) / (sum / kClients);
  fmt::print(
      "  equal priority: {:.0f} requests, the least served client has {:.2f} of its share  {}\n",
      sum, least, Verdict(least >= kWantedFairness));
  std::vector<std::uint16_t> ports(kClients, gateway.port);
  ports[kClients / 2] = gateway.high_port;
  const auto mixed = Share(ports, kClients / 2);
  sum = 0;
  for (const std::uint64_t count : mixed) sum += static_cast<double>(count);
  const double high = static_cast<double>(mixed[kClients / 2]) / sum;
  fmt::print("  one of high priority: {:.4f} of {:.0f} requests  {}\n", high, sum,
             Verdict(high >= kWantedHigh));
}

}  // namespace

void RunRoutes(const config::Catalog& catalog) {
  MeasureRoundTrip(catalog);
  MeasureSilences(catalog);
  MeasureFairness(catalog);
}

}  // namespace baudgate::bench
