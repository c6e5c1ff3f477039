// SPDX-License-Identifier: Apache-2.0
#include "gateway/tools/cli/offline/simulate.h"

#include <asio/io_context.hpp>
#include <asio/signal_set.hpp>
#include <csignal>

#include "gateway/tools/cli/offline/make_line.h"
#include "gateway/tools/simulate/simulator.h"

namespace baudgate {

int RunSimulate(const SimulateOptions& options, const config::Catalog& catalog, std::ostream& out,
                std::ostream& err) {
  const auto line = MakeLine(
      {.protocol = options.protocol,
       .serial = options.serial,
       .devices = {{.profile = options.profile, .address = options.address, .set = options.set}}},
      catalog);
  if (!line) {
    err << "baudgate: " << line.error() << "\n";
    return 3;
  }
  const config::Device& device = line->devices.front();
  SimulatorOptions simulator_options;
  simulator_options.link = options.pty;
  simulator_options.think_time = options.think_time;
  simulator_options.faults = options.faults;
  simulator_options.events = options.events;
  if (!options.serial.empty()) simulator_options.pace = line->serial;
  simulator_options.strict = !options.serial.empty();

  asio::io_context io(1);
  auto simulator =
      Simulator::Create(io, *catalog.FindProtocol(device.protocol), {device}, simulator_options);
  if (!simulator) {
    err << "baudgate: " << simulator.error() << "\n";
    return 4;
  }
  out << device.title << " at address " << device.address << " answers on " << (*simulator)->path()
      << (options.serial.empty() ? "" : ", paced at " + line->serial.ToString()) << std::endl;
  asio::signal_set stop(io, SIGTERM, SIGINT, SIGHUP);
  stop.async_wait([&io](const asio::error_code&, int) { io.stop(); });
  io.run();
  for (const FaultCount& count : (*simulator)->fault_counts()) {
    out << "fault " << count.fault << " struck " << count.struck << " of " << count.exchanges
        << " exchanges\n";
  }
  if (options.events) {
    const auto [raised, lost] = (*simulator)->event_counts();
    out << "events raised " << raised << ", lost for want of room " << lost << "\n";
  }
  return 0;
}

}  // namespace baudgate
