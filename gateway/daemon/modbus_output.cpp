// SPDX-License-Identifier: Apache-2.0
#include "gateway/daemon/modbus_output.h"

#include <utility>

#include "gateway/daemon/run_on.h"

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

ModbusOutput::Prepared ModbusOutput::Prepare(config::Modbus& next,
                                             reload::ModbusDifference& difference) const {
  Prepared prepared;
  for (std::size_t i = 0; i < next.listen.size();) {
    const reload::ListenerChange& change = difference.listeners[i];
    modbus::ListenerOrigin origin{change.was, change.fate == reload::Fate::same};
    Status status = server_.CanServe(next.listen[i]);
    if (status && change.fate == reload::Fate::added) {
      auto port = server_.OpenPort(next.listen[i]);
      if (port) origin.opened = std::move(*port);
      if (!port) status = Error{port.error()};
    }
    if (status) {
      prepared.renewal.listeners.push_back(std::move(origin));
      ++i;
      continue;
    }
    prepared.troubles.push_back("listener " + status.error());
    next.listen.erase(next.listen.begin() + static_cast<std::ptrdiff_t>(i));
    difference.listeners.erase(difference.listeners.begin() + static_cast<std::ptrdiff_t>(i));
  }
  for (std::size_t i = 0; i < next.routes.size(); ++i) {
    prepared.renewal.routes.push_back(difference.routes[i].was);
  }
  return prepared;
}

void ModbusOutput::Apply(const config::Config& config, std::span<RouteTarget* const> lines,
                         const modbus::Renewal& renewal) {
  modbus::ModbusServer::Ended ended;
  RunOn(loop_.io(), [&] { ended = server_.Apply(config, lines, renewal); });
  modbus::ModbusServer::ClosePorts(ended);
  RunOn(loop_.io(), [&] { server_.Finish(std::move(ended)); });
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
