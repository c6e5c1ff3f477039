// The Modbus TCP server of the gateway: serves the point store, hands writes to the lines.
// Design section 7. All belongs to the thread that runs the io_context (or to a time when it does
// not run), unless it says otherwise. Counters may be asked for from anywhere.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <asio/io_context.hpp>
#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "config/model/config.h"
#include "gateway/base/result.h"
#include "gateway/modbus/desk/links.h"
#include "gateway/modbus/desk/point_desk.h"
#include "gateway/modbus/desk/traffic.h"
#include "gateway/modbus/registers/register_contents.h"
#include "gateway/modbus/server/renewal.h"
#include "gateway/requests/commands.h"
#include "gateway/store/point_store.h"

namespace baudgate::modbus {

class Listener;
class PassedSockets;
class SerialListener;

class ModbusServer final : public TrafficSource {
 public:
  /// Store and sink outlive the server, the configuration does until Listen. `info` is asked when a
  /// client reads the gateway's own block, on the server's thread.
  ModbusServer(const config::Config& config, const PointStore& store, CommandSink& sink,
               std::function<GatewayFigures()> info, ModbusLimits limits = {},
               const ModbusLinks& links = {});
  ~ModbusServer() override;
  ModbusServer(const ModbusServer&) = delete;
  ModbusServer& operator=(const ModbusServer&) = delete;

  /// Opens every port of modbus.listen, or none: "127.0.0.1:1502: address already in use; …". A
  /// serial port that is absent is no error: it is opened when it appears.
  Status Listen(asio::io_context& io);

  // A reload: OpenPort for what is new, Apply, ClosePorts, Finish.

  /// The module that its frames need is loaded.
  Status CanServe(const config::Listener& listener) const;
  /// From any thread: a new TCP port, at which clients wait until it is given to Apply; dropped, it
  /// closes. Null at a serial port, which is opened by Finish.
  Result<std::shared_ptr<Listener>> OpenPort(const config::Listener& listener,
                                             PassedSockets* passed = nullptr) const;
  using Ended = std::vector<std::shared_ptr<SerialListener>>;
  /// Units, points, lines and routes, by the numbers of the store; then listeners: clients of those
  /// that are not the same are disconnected.
  Ended Apply(const config::Config& config, std::span<RouteTarget* const> lines,
              const Renewal& renewal);
  /// From any thread: serial ports that Apply has ended. A driver may take its time.
  static void ClosePorts(const Ended& ended);
  /// Opens serial ports that are new.
  void Finish(Ended ended);

  /// Closes ports and clients. Writes under way go on; their answers are dropped.
  void Stop();

  /// Of the listener with this index in modbus.listen; 0 while it does not listen, and for serial
  /// ports.
  std::uint16_t port(std::size_t listener = 0) const;
  /// "Modbus TCP on 0.0.0.0:502, a Modbus master on /dev/ttyS1"; empty: nowhere.
  std::string Summary() const;
  ModbusCounters counters() const { return points_->counters().Snapshot(); }
  /// From any thread.
  TrafficStatus Traffic() const override;

 private:
  /// One entry of modbus.listen: one of the two.
  struct Place {
    std::shared_ptr<Listener> tcp;
    std::shared_ptr<SerialListener> serial;
    bool is_begun = false;  ///< of the serial one
  };
  void Begin(const config::Listener& listener, std::shared_ptr<Listener> port);
  void OpenSerialPorts();
  static Ended End(std::vector<Place> places);

  const config::Config& config_;  // of the start
  std::unique_ptr<PointDesk> points_;
  asio::io_context* io_ = nullptr;  // null: it does not listen
  std::vector<Place> places_;       // as configured
};

}  // namespace baudgate::modbus
