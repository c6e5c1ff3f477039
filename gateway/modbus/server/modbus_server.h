// The Modbus TCP server of the gateway: serves the point store, hands writes to the lines.
// Design section 7. Runs on the thread that runs the io_context; Listen and Stop belong to that
// thread too (or to a time when it does not run). Counters may be asked for from anywhere.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <asio/io_context.hpp>
#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <vector>

#include "config/model/config.h"
#include "gateway/base/result.h"
#include "gateway/modbus/desk/links.h"
#include "gateway/modbus/desk/point_desk.h"
#include "gateway/modbus/desk/traffic.h"
#include "gateway/modbus/registers/register_contents.h"
#include "gateway/requests/commands.h"
#include "gateway/store/point_store.h"

namespace baudgate::modbus {

class Listener;
class PassedSockets;
class SerialListener;

class ModbusServer final : public TrafficSource {
 public:
  /// Configuration, store and sink outlive the server. `info` is asked when a client reads the
  /// gateway's own block, on the server's thread.
  ModbusServer(const config::Config& config, const PointStore& store, CommandSink& sink,
               std::function<GatewayFigures()> info, ModbusLimits limits = {},
               const ModbusLinks& links = {});
  ~ModbusServer() override;
  ModbusServer(const ModbusServer&) = delete;
  ModbusServer& operator=(const ModbusServer&) = delete;

  /// Opens every port of modbus.listen, or none: "127.0.0.1:1502: address already in use; …". A
  /// serial port that is absent is no error: it is opened when it appears.
  Status Listen(asio::io_context& io);
  /// A reload, on the server's thread: units, points and lines, by the numbers of the store.
  /// Clients stay, and `modbus` is as it was.
  void Apply(const config::Config& config, std::span<RouteTarget* const> lines);
  /// Closes ports and clients. Writes under way go on; their answers are dropped.
  void Stop();

  /// Of the listener with this index in modbus.listen; 0 while it does not listen, and for serial
  /// ports.
  std::uint16_t port(std::size_t listener = 0) const;
  ModbusCounters counters() const { return points_->counters().Snapshot(); }
  /// From any thread.
  TrafficStatus Traffic() const override;

 private:
  Status Open(asio::io_context& io, const config::Listener& listener, PassedSockets& passed);

  const config::Config& config_;
  std::unique_ptr<PointDesk> points_;
  std::vector<std::shared_ptr<Listener>> listeners_;  ///< as configured; null at serial ports
  std::vector<std::shared_ptr<SerialListener>> serial_listeners_;
};

}  // namespace baudgate::modbus
