// Starts and stops the listeners of the Modbus TCP server, and exchanges them at a reload.
// SPDX-License-Identifier: Apache-2.0
#include "gateway/modbus/server/modbus_server.h"

#include <algorithm>
#include <utility>

#include "gateway/modbus/serial/serial_listener.h"
#include "gateway/modbus/server/listener.h"
#include "gateway/modbus/server/passed_sockets.h"

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
  io_ = &io;
  points_->inbox()->Open(io, ReadClocks);
  points_->targets().Open(io, points_->book());
  PassedSockets passed;
  for (const config::Listener& listener : config_.modbus.listen) {
    auto port = OpenPort(listener, &passed);
    if (!port) {
      Stop();
      return Error{port.error()};
    }
    Begin(listener, std::move(*port));
  }
  OpenSerialPorts();
  return {};
}

Status ModbusServer::CanServe(const config::Listener& listener) const {
  const Protocol* const rtu = points_->rtu();
  const bool needs_rtu =
      listener.is_serial() || listener.protocol == config::Listener::Protocol::rtu;
  if (needs_rtu && (rtu == nullptr || rtu->carrier == nullptr)) {
    return Error{listener.Place() + ": RTU needs the module modbus_rtu, which is not loaded"};
  }
  return {};
}

Result<std::shared_ptr<Listener>> ModbusServer::OpenPort(const config::Listener& listener,
                                                         PassedSockets* passed) const {
  if (Status status = CanServe(listener); !status) return Error{status.error()};
  if (listener.is_serial()) return std::shared_ptr<Listener>();
  auto port = std::make_shared<Listener>(*io_, listener, *points_);
  if (Status status = port->Open(passed); !status) return Error{status.error()};
  return port;
}

void ModbusServer::Begin(const config::Listener& listener, std::shared_ptr<Listener> port) {
  Place& place = places_.emplace_back();
  if (port) {
    place.tcp = std::move(port);
    place.tcp->Start();
  } else {
    place.serial = std::make_shared<SerialListener>(*io_, listener, *points_, *points_->rtu());
  }
}

void ModbusServer::OpenSerialPorts() {
  for (Place& place : places_) {
    if (place.serial && !std::exchange(place.is_begun, true)) place.serial->Open();
  }
}

ModbusServer::Ended ModbusServer::Apply(const config::Config& config,
                                        std::span<RouteTarget* const> lines,
                                        const Renewal& renewal) {
  points_->SetClientShare(renewal.client_share);
  points_->Apply(config, lines, renewal.routes);
  std::vector<Place> before = std::exchange(places_, {});
  for (std::size_t i = 0; i < config.modbus.listen.size(); ++i) {
    const config::Listener& listener = config.modbus.listen[i];
    const ListenerOrigin& origin = renewal.listeners[i];
    const bool goes_on = origin.was && (origin.same || !listener.is_serial());
    if (!goes_on) {
      Begin(listener, origin.opened);
      continue;
    }
    places_.push_back(std::exchange(before[*origin.was], {}));
    if (!origin.same) places_.back().tcp->Renew(listener);
  }
  return End(std::move(before));
}

ModbusServer::Ended ModbusServer::End(std::vector<Place> places) {
  Ended ended;
  for (Place& place : places) {
    if (place.tcp) place.tcp->Stop();
    if (!place.serial) continue;
    place.serial->Leave();
    ended.push_back(std::move(place.serial));
  }
  return ended;
}

void ModbusServer::ClosePorts(const Ended& ended) {
  for (const auto& listener : ended) listener->ClosePort();
}

void ModbusServer::Finish(Ended ended) {
  ended.clear();
  OpenSerialPorts();
}

TrafficStatus ModbusServer::Traffic() const { return points_->book()->Status(ReadClocks()); }

void ModbusServer::Stop() {
  points_->inbox()->Close();
  ClosePorts(End(std::exchange(places_, {})));
  points_->targets().Close();
}

std::uint16_t ModbusServer::port(std::size_t listener) const {
  const bool known = listener < places_.size() && places_[listener].tcp;
  return known ? places_[listener].tcp->port() : 0;
}

std::string ModbusServer::Summary() const {
  std::string text;
  for (const Place& place : places_) {
    const std::string ports = place.tcp ? place.tcp->Summary() : place.serial->Summary();
    text += (text.empty() ? "" : ", ") + ports;
  }
  return text;
}

}  // namespace baudgate::modbus
