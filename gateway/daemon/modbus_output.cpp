// SPDX-License-Identifier: Apache-2.0
#include "gateway/daemon/modbus_output.h"

#include <utility>

#include "transports/run_on.h"

namespace baudgate {
ModbusOutput::ModbusOutput(const config::Config& config, Links links)
    : server_(config, links.store, links.commands, std::move(links.figures), links.limits,
              links.links) {}

Result<std::unique_ptr<ModbusOutput>> ModbusOutput::Start(const config::Config& config,
                                                          Links links) {
  std::unique_ptr<ModbusOutput> output(new ModbusOutput(config, std::move(links)));
  if (const Status status = output->server_.Listen(output->loop_.io()); !status) {
    return Error{status.error()};
  }
  output->loop_.Start();
  return output;
}

ModbusOutput::Prepared ModbusOutput::Prepare(const config::Modbus& next,
                                             const reload::ModbusDifference& difference) const {
  Prepared prepared;
  for (std::size_t i = 0; i < next.listen.size(); ++i) {
    const reload::ListenerChange& change = difference.listeners[i];
    modbus::ListenerOrigin& origin = prepared.renewal.listeners.emplace_back(
        modbus::ListenerOrigin{change.was, change.action == reload::Action::same});
    Status status = server_.CanServe(next.listen[i]);
    if (status && !origin.keeps_port(next.listen[i])) {
      auto port = server_.OpenPort(next.listen[i]);
      if (port) origin.opened = *std::move(port);
      if (!port) status = Error{port.error()};
    }
    if (!status) {
      prepared.troubles.push_back("listener " + next.listen[i].Place() + ": " + status.error());
    }
  }
  for (std::size_t i = 0; i < next.routes.size(); ++i) {
    prepared.renewal.routes.push_back(difference.routes[i].was);
  }
  return prepared;
}

std::vector<std::string> ModbusOutput::Apply(const config::Config& config,
                                             std::span<RouteTarget* const> lines,
                                             const modbus::Renewal& renewal) {
  modbus::ModbusServer::Ended ended;
  RunOn(loop_.io(), [&] { ended = server_.Apply(config, lines, renewal); });
  modbus::ModbusServer::ClosePorts(ended);
  std::vector<std::string> missing;
  RunOn(loop_.io(), [&] {
    server_.Finish(std::move(ended));
    missing = server_.Missing();
  });
  return missing;
}

std::string ModbusOutput::Summary() {
  std::string summary;
  RunOn(loop_.io(), [&] { summary = server_.Summary(); });
  return summary;
}

ModbusOutput::~ModbusOutput() { Stop(); }

void ModbusOutput::Stop() {
  loop_.Stop([this] { server_.Stop(); });
}

}  // namespace baudgate
