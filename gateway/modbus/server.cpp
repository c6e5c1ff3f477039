// Starts and stops the listeners of the Modbus TCP server.
// SPDX-License-Identifier: Apache-2.0
#include "gateway/modbus/server.h"

#include <utility>

#include "gateway/modbus/listener.h"

namespace baudgate::modbus {

ModbusServer::ModbusServer(const config::Config& config, const PointStore& store, CommandSink& sink,
                           std::function<GatewayInfo()> info, ModbusLimits limits, ModbusLinks)
    : config_(config),
      service_(std::make_unique<Service>(config, store, sink, std::move(info), limits)) {}

ModbusServer::~ModbusServer() { Stop(); }

Status ModbusServer::Listen(asio::io_context& io) {
  if (!config_.modbus.enabled) return {};
  if (!service_->responder().ready()) return service_->responder().ready();
  service_->inbox()->Open(io);
  for (const config::Listener& listener : config_.modbus.listen) {
    listeners_.push_back(std::make_shared<Listener>(io, listener, *service_));
    const Status opened = listeners_.back()->Open();
    if (!opened) {
      Stop();
      return opened;
    }
  }
  return {};
}

TrafficStatus ModbusServer::Traffic() const { return {}; }

void ModbusServer::Stop() {
  service_->inbox()->Close();
  for (const auto& listener : listeners_) listener->Stop();
  listeners_.clear();
}

std::uint16_t ModbusServer::port(std::size_t listener) const {
  return listener < listeners_.size() ? listeners_[listener]->port() : 0;
}

}  // namespace baudgate::modbus
