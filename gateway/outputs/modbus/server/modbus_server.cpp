// SPDX-License-Identifier: Apache-2.0
#include "gateway/outputs/modbus/server/modbus_server.h"

#include <system_error>
#include <utility>

#include "gateway/base/log.h"
#include "gateway/outputs/modbus/serial/serial_listener.h"
#include "gateway/outputs/modbus/server/listener.h"
#include "transports/tls_context.h"

namespace baudgate::modbus {

ModbusServer::ModbusServer(const config::Config& config, const bus::PointStore& store,
                           bus::CommandSink& sink, std::function<GatewayFigures()> info,
                           ModbusLimits limits, const ModbusLinks& links)
    : config_(config),
      shared_(std::make_unique<ServerShared>(config, store, sink, std::move(info), limits, links)) {
}

ModbusServer::~ModbusServer() { Stop(); }

namespace {

/// Returns an error if the listener uses TLS, and its files cannot be used.
Status CheckTls(const config::Listener& listener) {
  if (!listener.tls.on()) return {};
  const auto context = tls::ContextFiles(tls::End::server, listener.tls).Current();
  return context ? Status() : Error{context.error()};
}

}  // namespace

Status ModbusServer::Listen(asio::io_context& io) {
  if (!config_.modbus.enabled) return {};
  if (Status ready = shared_->Ready(); !ready) return ready;
  io_ = &io;
  retry_.emplace(io);
  shared_->Open(io, ReadClocks);
  PassedSockets passed;
  for (const config::Listener& listener : config_.modbus.listen) {
    // A certificate that was renewed wrongly must not stop the polls; Look tries again.
    if (!CheckTls(listener)) {
      places_.push_back({.listener = listener});
      continue;
    }
    auto port = OpenPort(listener, &passed);
    if (!port) {
      Stop();
      return Error{listener.Address() + ": " + port.error()};
    }
    places_.push_back({.listener = listener, .port = *std::move(port)});
  }
  Look();
  BeginSerial();
  return {};
}

Status ModbusServer::CanServe(const config::Listener& listener) const {
  if (!listener.speaks_serial()) return CheckTls(listener);
  const protocols::Protocol* const protocol = shared_->frames().Of(listener.framing);
  if (protocol != nullptr && protocol->carrier != nullptr) return {};
  return Error{std::string(Title(listener.framing)) + " needs the module modbus_" +
               std::string(Name(listener.framing)) + ", which is not loaded"};
}

Result<ListenerPort> ModbusServer::OpenPort(const config::Listener& listener,
                                            PassedSockets* passed) const try {
  if (Status status = CanServe(listener); !status) return Error{status.error()};
  ListenerPort port;
  if (listener.is_serial()) {
    port.serial = std::make_shared<SerialListener>(*io_, listener, *shared_);
    return port;
  }
  port.tcp = std::make_shared<Listener>(*io_, listener, *shared_);
  if (Status status = port.tcp->Open(passed); !status) return Error{status.error()};
  return port;
} catch (const std::system_error& failed) {
  // The thread of a serial port cannot be created, because file descriptors are missing.
  return Error{failed.code().message()};
}

void ModbusServer::BeginTcp() {
  for (Place& place : places_) {
    if (place.port.tcp && !std::exchange(place.is_begun, true)) place.port.tcp->Start();
  }
}

void ModbusServer::BeginSerial() {
  for (Place& place : places_) {
    if (place.port.serial && !std::exchange(place.is_begun, true)) place.port.serial->Open();
  }
}

Status ModbusServer::LookAt(Place& place) const {
  if (place.port.tcp) return place.port.tcp->HasAddress();
  if (place.port) return {};
  auto port = OpenPort(place.listener);
  if (!port) return Error{port.error()};
  place.port = *std::move(port);
  return {};
}

void ModbusServer::Look() {
  std::vector<ClosedListener> closed;
  for (Place& place : places_) {
    const Status looked = LookAt(place);
    const std::string before =
        std::exchange(place.why_not, looked ? std::string() : looked.error());
    if (looked) {
      if (!before.empty()) log::Info("modbus: listener {} is open now", place.listener.Address());
      continue;
    }
    const ClosedListener one{place.listener.Address(), place.why_not,
                             static_cast<bool>(place.port)};
    if (place.why_not != before) {
      log::Warn("modbus: listener {}: {}{}", one.place, one.why,
                one.is_open ? "" : "; the gateway tries again each second");
    }
    closed.push_back(one);
  }
  shared_->book()->ShowClosed(std::move(closed));
  BeginTcp();
  retry_->expires_after(kTryEvery);
  retry_->async_wait([this](const asio::error_code& stopped) {
    if (stopped) return;
    Look();
    BeginSerial();
  });
}

std::vector<std::string> ModbusServer::Missing() const {
  std::vector<std::string> missing;
  for (const Place& place : places_) {
    if (!place.port)
      missing.push_back("listener " + place.listener.Address() + ": " + place.why_not);
  }
  return missing;
}

ModbusServer::Ended ModbusServer::Apply(const config::Config& config,
                                        std::span<bus::RouteTarget* const> lines,
                                        const Renewal& renewal) {
  shared_->SetClientShare(renewal.client_share);
  shared_->Apply(config, lines, renewal.routes);
  std::vector<Place> before = std::exchange(places_, {});
  for (std::size_t i = 0; i < config.modbus.listen.size(); ++i) {
    const config::Listener& listener = config.modbus.listen[i];
    const ListenerOrigin& origin = renewal.listeners[i];
    Place& place = places_.emplace_back(Place{.listener = listener, .port = origin.opened});
    if (!origin.keeps_port(listener)) continue;
    Place& was = before[*origin.was];
    place.port = std::exchange(was.port, {});
    place.why_not = was.why_not;
    place.is_begun = was.is_begun;
    if (!origin.same && place.port) place.port.tcp->Renew(listener);
  }
  Ended ended = End(std::move(before));
  Look();
  return ended;
}

ModbusServer::Ended ModbusServer::End(std::vector<Place> places) {
  Ended ended;
  for (Place& place : places) {
    if (place.port.tcp) place.port.tcp->Stop();
    if (!place.port.serial) continue;
    place.port.serial->Leave();
    ended.push_back(std::move(place.port.serial));
  }
  return ended;
}

void ModbusServer::ClosePorts(const Ended& ended) {
  for (const auto& listener : ended) listener->ClosePort();
}

void ModbusServer::Finish(Ended ended) {
  ended.clear();
  BeginSerial();
}

TrafficStatus ModbusServer::Traffic() const { return shared_->book()->Status(ReadClocks()); }

void ModbusServer::Stop() {
  shared_->CloseInbox();
  if (retry_) retry_->cancel();
  ClosePorts(End(std::exchange(places_, {})));
  shared_->CloseRoutes();
}

std::uint16_t ModbusServer::port(std::size_t listener) const {
  const bool known = listener < places_.size() && places_[listener].port.tcp;
  return known ? places_[listener].port.tcp->port() : 0;
}

std::string ModbusServer::Summary() const {
  std::string text;
  for (const Place& place : places_) {
    if (!place.port) continue;
    text += text.empty() ? "" : ", ";
    text += place.port.tcp ? place.port.tcp->Summary() : place.port.serial->Summary();
  }
  return text;
}

}  // namespace baudgate::modbus
