// `ModbusOutput` is the Modbus server as an output of the gateway, on its own thread.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <map>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "config/model/config.h"
#include "gateway/base/result.h"
#include "gateway/outputs/modbus/server/modbus_server.h"
#include "gateway/outputs/modbus/service/modbus_difference.h"
#include "gateway/outputs/output.h"
#include "transports/loop_thread.h"

namespace baudgate::modbus {

inline constexpr outputs::Metric kModbusClients{"baudgate_modbus_clients", "gauge",
                                                "Modbus clients that are connected."};
inline constexpr outputs::Metric kModbusRequests{"baudgate_modbus_requests_total", "counter",
                                                 "Requests of Modbus clients that were answered."};

class ModbusOutput final : public outputs::Output {
 public:
  /// All referenced objects must outlive the output.
  struct Links {
    const bus::PointStore& store;
    bus::CommandSink& commands;
    std::function<modbus::GatewayFigures()> figures;
    /// Raises the limit of file descriptors as far as `config` needs. Returns the share of
    /// `max_clients` that can connect with the available descriptors.
    std::function<double(const config::Config& config)> make_room;
    std::function<std::vector<bus::RouteTarget*>()> lines;
    modbus::ModbusLinks server;  ///< without `lines`, which the function above returns
  };
  explicit ModbusOutput(Links links) : links_(std::move(links)) {}
  ~ModbusOutput() override { StopRequests(); }
  static outputs::DescriptorNeeds Descriptors(const config::Config& config);

  std::string_view name() const override { return "modbus"; }
  /// Opens the ports and starts the thread; does nothing if the configuration has no server. The
  /// error contains the address.
  Status Open(const Configuration& config) override;
  void CountClients(std::map<std::string, std::size_t>& by_listener) const override;
  std::unique_ptr<Prepared> Prepare(const config::Config& next) override;
  std::vector<std::string> Apply(const Configuration& config,
                                 std::unique_ptr<Prepared> prepared) override;
  void StopRequests() override;
  std::string Summary() override;
  std::optional<Json> Section(const Wish& wish) const override;
  std::vector<outputs::Series> Metrics() const override;
  asio::io_context* loop() override { return server_ ? &loop_.io() : nullptr; }

 private:
  modbus::TrafficStatus Traffic() const;

  const Links links_;
  Configuration config_;
  transports::LoopThread loop_{"modbus"};
  std::unique_ptr<modbus::ModbusServer> server_;  // null: the server is off
};

std::vector<outputs::Series> MetricsOf(const modbus::TrafficStatus& traffic);

}  // namespace baudgate::modbus
