// The Modbus TCP server of the gateway: serves the point store, hands writes to the lines.
// All belongs to the thread that runs the io_context (or to a time when it does
// not run), unless it says otherwise. Counters may be asked for from anywhere. Renewal says what a
// reload leaves of listeners and routes.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <asio/io_context.hpp>
#include <asio/steady_timer.hpp>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "config/model/config.h"
#include "config/model/outputs.h"
#include "gateway/base/result.h"
#include "gateway/bus/points/point_store.h"
#include "gateway/bus/writes/write_command.h"
#include "gateway/outputs/modbus/registers/register_contents.h"
#include "gateway/outputs/modbus/service/client_requests.h"
#include "gateway/outputs/modbus/service/route_table.h"
#include "gateway/outputs/modbus/service/traffic.h"

namespace baudgate::modbus {

class Listener;
class SerialListener;

/// What serves one entry of modbus.listen: one of the two. Neither: it could not be made.
struct ListenerPort {
  std::shared_ptr<Listener> tcp{};
  std::shared_ptr<SerialListener> serial{};

  explicit operator bool() const { return tcp || serial; }
};

/// Where one entry of the new modbus.listen comes from.
struct ListenerOrigin {
  std::optional<std::size_t> was;  ///< its place in the list before; empty: it is new
  bool same = false;               ///< its clients stay
  ListenerPort opened{};           ///< of a new one: ModbusServer::OpenPort

  /// A serial port is closed and opened again where anything of it differs.
  bool keeps_port(const config::Listener& now) const { return was && (same || !now.is_serial()); }
};

/// What a reload leaves of the listeners and routes that run: ModbusOutput says so, and
/// ModbusServer acts on it.
struct Renewal {
  std::vector<ListenerOrigin> listeners;
  Origins routes;
  double client_share = 1;  ///< see ModbusLimits
};

class PassedSockets;

class ModbusServer {
 public:
  /// Store and sink outlive the server, the configuration does until Listen. `info` is asked when a
  /// client reads the gateway's own block, on the server's thread.
  ModbusServer(const config::Config& config, const bus::PointStore& store, bus::CommandSink& sink,
               std::function<GatewayFigures()> info, ModbusLimits limits = {},
               const ModbusLinks& links = {});
  ~ModbusServer();
  ModbusServer(const ModbusServer&) = delete;
  ModbusServer& operator=(const ModbusServer&) = delete;

  /// Opens every port of modbus.listen, or none: "127.0.0.1:1502: address already in use; …". A
  /// serial port that is absent is no error: it is opened when it appears.
  Status Listen(asio::io_context& io);

  // A reload: OpenPort for what is new, Apply, ClosePorts, Finish.

  /// The module that its frames need is loaded. The error is a reason without the place, as that of
  /// OpenPort.
  Status CanServe(const config::Listener& listener) const;
  /// From any thread: a new port, at which TCP clients wait until it is given to Apply; dropped, it
  /// closes. A serial one is made here and opened by Finish.
  Result<ListenerPort> OpenPort(const config::Listener& listener,
                                PassedSockets* passed = nullptr) const;
  using Ended = std::vector<std::shared_ptr<SerialListener>>;
  /// Units, points, lines and routes, by the numbers of the store; then listeners: clients of those
  /// that are not the same are disconnected. A new one without a port is tried each second.
  Ended Apply(const config::Config& config, std::span<bus::RouteTarget* const> lines,
              const Renewal& renewal);
  /// From any thread: serial ports that Apply has ended. A driver may take its time.
  static void ClosePorts(const Ended& ended);
  /// Opens serial ports that are new.
  void Finish(Ended ended);
  /// What is tried each second: "listener 0.0.0.0:502: address already in use; …".
  std::vector<std::string> Missing() const;

  /// Closes ports and clients. Writes under way go on; their answers are dropped.
  void Stop();

  /// The port of the listener with this index in modbus.listen; 0 while closed, and for serial
  /// ports.
  std::uint16_t port(std::size_t listener = 0) const;
  /// "Modbus TCP on 0.0.0.0:502, a Modbus master on /dev/ttyS1"; empty: nowhere.
  std::string Summary() const;
  ModbusCounters counters() const { return shared_->counters().Snapshot(); }
  /// From any thread.
  TrafficStatus Traffic() const;

 private:
  static constexpr Duration kTryEvery = 1s;

  /// One entry of modbus.listen.
  struct Place {
    config::Listener listener;
    ListenerPort port{};
    std::string why_not{};  ///< no client can come in; empty: they can
    bool is_begun = false;
  };
  /// Opens what is not open, and finds addresses that have left the machine; each second.
  void Look();
  Status LookAt(Place& place) const;
  void BeginTcp();
  void BeginSerial();
  static Ended End(std::vector<Place> places);

  const config::Config& config_;  // of the start
  std::unique_ptr<ServerShared> shared_;
  asio::io_context* io_ = nullptr;  // null: it does not listen
  std::optional<asio::steady_timer> retry_;
  std::vector<Place> places_;  // as configured
};

}  // namespace baudgate::modbus
