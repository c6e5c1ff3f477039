// The Modbus server on a thread of its own.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "config/model/config.h"
#include "gateway/base/result.h"
#include "gateway/daemon/reload/modbus_difference.h"
#include "gateway/outputs/modbus/server/modbus_server.h"
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

  /// The ports that a reload opens before it changes anything. If it is dropped, they close.
  struct Prepared {
    modbus::Renewal renewal;
    /// "listener 0.0.0.0:502: address already in use; …", one for each port that stays closed.
    std::vector<std::string> troubles;
  };
  Prepared Prepare(const config::Modbus& next, const reload::ModbusDifference& difference) const;
  /// Does the rest of the reload, and returns what could not be applied; see ModbusServer.
  std::vector<std::string> Apply(const config::Config& config, std::span<RouteTarget* const> lines,
                                 const modbus::Renewal& renewal);
  /// Closes ports and clients. Idempotent.
  void Stop();

  const modbus::ModbusServer& server() const { return server_; }
  /// See ModbusServer; between Start and Stop.
  std::string Summary();
  asio::io_context& io() { return loop_.io(); }

 private:
  ModbusOutput(const config::Config& config, Links links);

  LoopThread loop_{"modbus"};
  modbus::ModbusServer server_;
};

}  // namespace baudgate
