// Starts and stops the listeners of the Modbus TCP server.
// SPDX-License-Identifier: Apache-2.0
#include "gateway/modbus/server/modbus_server.h"

#include <utility>

#include "gateway/modbus/serial/serial_listener.h"
#include "gateway/modbus/server/listener.h"

namespace baudgate::modbus {

ModbusServer::ModbusServer(const config::Config& config, const PointStore& store, CommandSink& sink,
                           std::function<GatewayFigures()> info, ModbusLimits limits,
                           const ModbusLinks& links)
    : config_(config),
      points_(std::make_unique<PointDesk>(config, store, sink, std::move(info), limits, links)) {}

ModbusServer::~ModbusServer() { Stop(); }

Status ModbusServer::Listen(asio::io_context& io) {
  if (!config_.modbus.enabled) return {};
  if (!points_->responder().ready()) return points_->responder().ready();
  points_->inbox()->Open(io, ReadClocks);
  points_->targets().Open(io, points_->book());
  PassedSockets passed;
  for (const config::Listener& listener : config_.modbus.listen) {
    const Status opened = Open(io, listener, passed);
    if (!opened) {
      Stop();
      return opened;
    }
  }
  return {};
}

Status ModbusServer::Open(asio::io_context& io, const config::Listener& listener,
                          PassedSockets& passed) {
  const Protocol* const rtu = points_->rtu();
  const bool needs_rtu =
      listener.is_serial() || listener.protocol == config::Listener::Protocol::rtu;
  if (needs_rtu && (rtu == nullptr || rtu->carrier == nullptr)) {
    return Error{listener.Place() + ": RTU needs the module modbus_rtu, which is not loaded"};
  }
  if (listener.is_serial()) {
    listeners_.push_back(nullptr);
    serial_listeners_.push_back(std::make_shared<SerialListener>(io, listener, *points_, *rtu));
    serial_listeners_.back()->Open();
    return {};
  }
  listeners_.push_back(std::make_shared<Listener>(io, listener, *points_));
  return listeners_.back()->Open(passed);
}

void ModbusServer::Apply(const config::Config& config, std::span<RouteTarget* const> lines) {
  points_->Apply(config, lines);
}

TrafficStatus ModbusServer::Traffic() const { return points_->book()->Status(ReadClocks()); }

void ModbusServer::Stop() {
  points_->inbox()->Close();
  for (const auto& listener : listeners_) {
    if (listener) listener->Stop();
  }
  for (const auto& listener : serial_listeners_) listener->Stop();
  listeners_.clear();
  serial_listeners_.clear();
  points_->targets().Close();
}

std::uint16_t ModbusServer::port(std::size_t listener) const {
  const bool known = listener < listeners_.size() && listeners_[listener];
  return known ? listeners_[listener]->port() : 0;
}

}  // namespace baudgate::modbus
