// The Modbus server on a thread of its own.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <memory>
#include <vector>

#include "config/model/config.h"
#include "gateway/base/result.h"
#include "gateway/modbus/server/modbus_server.h"
#include "transports/loop_thread.h"

namespace baudgate {

class ModbusOutput {
 public:
  struct Links {
    const PointStore& store;
    CommandSink& commands;
    std::function<modbus::GatewayFigures()> figures;
    modbus::ModbusLimits limits;
    modbus::ModbusLinks links;
  };
  /// Listens, then starts the thread; all of it outlives this. The error names the port.
  static Result<std::unique_ptr<ModbusOutput>> Start(const config::Config& config, Links links);
  ~ModbusOutput();  ///< Stop

  /// A reload, done when it returns; see ModbusServer.
  void Apply(const config::Config& config, std::vector<RouteTarget*> lines);
  /// Closes ports and clients. Idempotent.
  void Stop();

  const modbus::ModbusServer& server() const { return server_; }
  asio::io_context& io() { return loop_.io(); }

 private:
  ModbusOutput(const config::Config& config, Links links);

  LoopThread loop_{"modbus"};
  modbus::ModbusServer server_;
};

}  // namespace baudgate
