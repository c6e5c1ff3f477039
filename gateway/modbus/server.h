// The Modbus TCP server of the gateway: serves the point store, hands writes to the lines.
// Design section 7. Runs on the thread that runs the io_context; Listen and Stop belong to that
// thread too (or to a time when it does not run). Counters may be asked for from anywhere.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <asio/io_context.hpp>
#include <cstdint>
#include <functional>
#include <memory>
#include <vector>

#include "config/config.h"
#include "gateway/base/result.h"
#include "gateway/commands.h"
#include "gateway/modbus/device_image.h"
#include "gateway/modbus/service.h"
#include "gateway/modbus/traffic.h"
#include "gateway/point_store.h"
#include "gateway/routed.h"
#include "protocols/protocol.h"

namespace baudgate::modbus {

class Listener;

/// What routes and RTU clients need beside the store; all of it outlives the server.
struct ModbusLinks {
  std::vector<RouteTarget*> lines;  ///< by index in config.lines; empty when no route leads to one
  const Protocol* rtu = nullptr;    ///< modbus_rtu: frames of RTU clients; null: none are served
};

class ModbusServer final : public TrafficSource {
 public:
  /// Configuration, store and sink outlive the server. `info` is asked when a client reads the
  /// gateway's own block, on the server's thread.
  ModbusServer(const config::Config& config, const PointStore& store, CommandSink& sink,
               std::function<GatewayInfo()> info, ModbusLimits limits = {}, ModbusLinks links = {});
  ~ModbusServer() override;
  ModbusServer(const ModbusServer&) = delete;
  ModbusServer& operator=(const ModbusServer&) = delete;

  /// Opens every port of modbus.listen, or none: "127.0.0.1:1502: address already in use; …".
  Status Listen(asio::io_context& io);
  /// Closes ports and clients. Writes under way go on; their answers are dropped.
  void Stop();

  /// Of the listener with this index in modbus.listen; 0 while it does not listen.
  std::uint16_t port(std::size_t listener = 0) const;
  ModbusCounters counters() const { return service_->counters().Snapshot(); }
  /// From any thread.
  TrafficStatus Traffic() const override;

 private:
  const config::Config& config_;
  std::unique_ptr<Service> service_;
  std::vector<std::shared_ptr<Listener>> listeners_;
};

}  // namespace baudgate::modbus
