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

void ModbusOutput::Apply(const config::Config& config, std::vector<RouteTarget*> lines) {
  RunOn(loop_.io(), [&] { server_.Apply(config, lines); });
}

ModbusOutput::~ModbusOutput() { Stop(); }

void ModbusOutput::Stop() {
  loop_.Stop([this] { server_.Stop(); });
}

}  // namespace baudgate
