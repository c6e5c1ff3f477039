// SPDX-License-Identifier: Apache-2.0
#include "gateway/outputs/modbus/server/modbus_output.h"

#include <fmt/format.h>

#include <utility>

#include "gateway/outputs/modbus/service/traffic_json.h"
#include "transports/loop_thread.h"
#include "transports/tls_handshakes.h"

namespace baudgate::modbus {
namespace {

struct Ports final : outputs::Output::Prepared {
  modbus::Renewal renewal;
};

}  // namespace

/// Returns the number of file descriptors that the server needs. It contains a reserve, because a
/// reload opens new ports before it closes old ports. A serial port needs more, because it has an
/// event loop of its own.
outputs::DescriptorNeeds ModbusOutput::Descriptors(const config::Config& config) {
  constexpr std::size_t kForSerialPort = 8;
  constexpr std::size_t kForListener = 4;
  constexpr std::size_t kForServer = 2;
  outputs::DescriptorNeeds needs;
  if (!config.modbus.enabled) return needs;
  needs.others = config.modbus.routes.size() * kForServer;
  for (const config::Listener& listener : config.modbus.listen) {
    needs.others += listener.is_serial() ? kForSerialPort : kForListener;
    if (listener.is_serial()) continue;
    needs.clients += static_cast<std::size_t>(std::max(listener.max_clients, 1));
    if (listener.tls.on()) needs.others += tls::Handshakes::kMost;
  }
  return needs;
}

Status ModbusOutput::Open(const Configuration& config) {
  if (!config->modbus.enabled) return {};
  config_ = config;
  modbus::ModbusLinks links = links_.server;
  links.lines = links_.lines();
  modbus::ModbusLimits limits;
  limits.client_share = links_.make_room(*config);
  server_ = std::make_unique<modbus::ModbusServer>(*config, links_.store, links_.commands,
                                                   links_.figures, limits, links);
  if (Status status = server_->Listen(loop_.io()); !status) {
    server_.reset();
    return status;
  }
  loop_.Start();
  return {};
}

void ModbusOutput::CountClients(std::map<std::string, std::size_t>& by_listener) const {
  for (const modbus::ClientStatus& client : Traffic().clients) ++by_listener[client.listener];
}

std::unique_ptr<outputs::Output::Prepared> ModbusOutput::Prepare(const config::Config& next) {
  auto prepared = std::make_unique<Ports>();
  prepared->renewal.client_share = links_.make_room(next);
  if (!server_) return prepared;
  const reload::ModbusDifference difference = reload::CompareModbus(config_->modbus, next.modbus);
  for (std::size_t i = 0; i < next.modbus.listen.size(); ++i) {
    const config::Listener& listener = next.modbus.listen[i];
    const reload::ListenerChange& change = difference.listeners[i];
    modbus::ListenerOrigin& origin = prepared->renewal.listeners.emplace_back(
        modbus::ListenerOrigin{change.was, change.action == reload::Action::same});
    Status status = origin.same ? Status() : server_->CanServe(listener);
    if (status && !origin.keeps_port(listener)) {
      auto port = server_->OpenPort(listener);
      if (port) origin.opened = *std::move(port);
      if (!port) status = Error{port.error()};
    }
    if (!status) {
      prepared->troubles.push_back("listener " + listener.Address() + ": " + status.error());
    }
  }
  for (std::size_t i = 0; i < next.modbus.routes.size(); ++i) {
    prepared->renewal.routes.push_back(difference.routes[i].was);
  }
  return prepared;
}

std::vector<std::string> ModbusOutput::Apply(const Configuration& config,
                                             std::unique_ptr<Prepared> prepared) {
  if (!server_) return {};
  config_ = config;
  const modbus::Renewal& renewal = static_cast<Ports&>(*prepared).renewal;
  const std::vector<bus::RouteTarget*> lines = links_.lines();
  modbus::ModbusServer::Ended ended;
  transports::RunOn(loop_.io(), [&] { ended = server_->Apply(*config, lines, renewal); });
  modbus::ModbusServer::ClosePorts(ended);
  std::vector<std::string> missing;
  transports::RunOn(loop_.io(), [&] {
    server_->Finish(std::move(ended));
    missing = server_->Missing();
  });
  return missing;
}

void ModbusOutput::StopRequests() {
  loop_.Stop([this] {
    if (server_) server_->Stop();
  });
}

std::string ModbusOutput::Summary() {
  std::string summary;
  if (server_) transports::RunOn(loop_.io(), [&] { summary = server_->Summary(); });
  return summary;
}

modbus::TrafficStatus ModbusOutput::Traffic() const {
  return server_ ? server_->Traffic() : modbus::TrafficStatus{};
}

std::optional<outputs::Output::Json> ModbusOutput::Section(const Wish& wish) const {
  return TrafficJson(Traffic(), wish.line, wish.now);
}

std::vector<outputs::Series> ModbusOutput::Metrics() const { return MetricsOf(Traffic()); }

std::vector<outputs::Series> MetricsOf(const modbus::TrafficStatus& traffic) {
  outputs::Families<modbus::RouteStatus> routes;
  for (const modbus::RouteStatus& route : traffic.routes) {
    routes.Add(route, fmt::format("units=\"{}\",target=\"{}\"", outputs::EscapedLabel(route.units),
                                  outputs::EscapedLabel(route.target)));
  }
  std::vector<outputs::Series> metrics = routes.all();
  metrics.emplace_back(kModbusClients, static_cast<double>(traffic.clients.size()));
  outputs::Series& requests = metrics.emplace_back(kModbusRequests);
  for (const modbus::FunctionCount& count : traffic.functions) {
    requests.Add(fmt::format("listener=\"{}\",function=\"{}\",exception=\"{}\"",
                             outputs::EscapedLabel(count.listener),
                             count.function > 0 ? fmt::to_string(count.function) : "other",
                             count.exception > 0 ? fmt::to_string(count.exception) : "none"),
                 static_cast<double>(count.requests));
  }
  return metrics;
}

}  // namespace baudgate::modbus
