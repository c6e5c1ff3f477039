// Benchmark: time from a PLC's start command to a changed frequency, through a transparent route to
// an inverter on RS-485 at 19200 8E1.
// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <algorithm>
#include <thread>

#include "gateway/daemon/daemon.h"
#include "tests/bench/bare_gateway.h"
#include "tests/bench/bench.h"
#include "tests/bench/drive_plc.h"
#include "tests/bench/drive_slave.h"

namespace baudgate::bench {
namespace {

int ReadsBefore(const std::vector<OnWire>& log, Instant sent) {
  int reads = 0;
  for (const OnWire& request : log) {
    if (request.from < sent) continue;
    if (request.pdu == StartPdu()) return reads;
    // In this time the start command can still be inside the gateway, so a read that is sent before
    // it does not count.
    const bool on_its_way = request.from < sent + 1ms;
    if (request.pdu.starts_with("03") && !on_its_way) ++reads;
  }
  return reads;
}

double Milliseconds(Duration time) {
  return std::chrono::duration<double, std::milli>(time).count();
}

struct Setup {
  const char* name;
  bool blocks;
  bool high;
};

void Measure(const config::Catalog& catalog, const Setup& setup) {
  std::string points;
  for (const std::uint16_t block : kBlocks) {
    points += fmt::format(
        "{{ name: block_{0}, read: \"holding {0}\", type: uint16, access: rw }}, ", block + 37);
  }
  const config::Config twin = Load(
      "modbus: { enabled: false }\ndds: { enabled: false }\nlines:\n  - { name: drive, port: "
      "/dev/null, serial: 19200 8E1, protocol: modbus_rtu, devices: [ { name: drive, address: 20, "
      "profile: mitsubishi-fr-d700, points: [ " +
          points + "] } ] }\n",
      catalog);
  Drive drive(*catalog.FindProtocol("modbus_rtu"), twin.lines[0].devices[0], twin.lines[0].serial);
  const std::uint16_t port = BareGateway("/dev/null").port();
  const std::uint16_t high_port = BareGateway("/dev/null").port();
  daemon::Daemon daemon(
      Load(
          fmt::format("dds: {{ enabled: false }}\nmodbus:\n"
                      "  listen: [ \"127.0.0.1:{}\", {{ at: \"127.0.0.1:{}\", priority: high }} ]\n"
                      "  routes: [ {{ units: \"20\", line: drive }} ]\n"
                      "lines:\n  - {{ name: drive, port: {}, serial: 19200 8E1, protocol: "
                      "modbus_rtu }}\n",
                      port, high_port, drive.path()),
          catalog),
      catalog);
  if (!daemon.Start()) std::exit(4);
  std::this_thread::sleep_for(200ms);
  Plc plc(port, setup.high ? high_port : port, setup.blocks);
  plc.Run();
  std::this_thread::sleep_for(1s);
  const auto log = drive.log();
  std::vector<double> times;
  int overtaken = 0;
  for (const Plc::Start& start : plc.starts) {
    if (start.seen) times.push_back(Milliseconds(*start.seen - start.sent));
    overtaken = std::max(overtaken, ReadsBefore(log, start.sent));
  }
  const bus::LineStatus line = daemon.store().ReadLine(0);
  const bool counted = line.bytes_out == drive.bytes_in && line.bytes_in == drive.bytes_out &&
                       line.exchanges == log.size();
  const bool clean = plc.mismatches == 0 && drive.overlaps == 0 && drive.short_silences == 0 &&
                     overtaken == 0 && counted && times.size() == plc.starts.size();
  const auto in_time = std::ranges::count_if(times, [](double time) { return time <= 70; });
  fmt::print(
      "  {:<24} {} starts, frequency seen after {:.0f} ms in the median ({:.0f} to {:.0f}), {} "
      "within 70 ms\n",
      setup.name, times.size(), Median(times), Percentile(times, 0), Percentile(times, 1), in_time);
  fmt::print(
      "    {} answers, {} exceptions, {} wrong ids, {} overlaps, {} short silences, at most {} "
      "reads before a start, counters {}  {}\n",
      plc.answered, plc.exceptions, plc.mismatches, drive.overlaps.load(),
      drive.short_silences.load(), overtaken, counted ? "equal the traffic" : "DIFFER",
      Verdict(clean));
}

}  // namespace

void RunDrive(const config::Catalog& catalog) {
  fmt::print(
      "an inverter at 19200 8E1 that answers after 5 ms, a PLC with five messages every {} ms\n",
      kPlcPeriod / 1ms);
  constexpr Setup kSetups[] = {{"cyclic messages only", false, false},
                               {"and whole blocks", true, false},
                               {"cyclic, frequency apart", false, true},
                               {"blocks, frequency apart", true, true}};
  for (const Setup& setup : kSetups) Measure(catalog, setup);
}

}  // namespace baudgate::bench
