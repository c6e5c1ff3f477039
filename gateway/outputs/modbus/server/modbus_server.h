// `ModbusServer` is the gateway's Modbus TCP server: it serves the point store and passes writes to
// the lines. All functions: on the thread that runs the io_context, or while none does, unless
// their comment allows other threads. Counters may be read on any thread. `Renewal` contains what a
// reload leaves unchanged of listeners and routes.
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

/// The object that serves one entry of modbus.listen: `tcp` or `serial`. Both are null if it could
/// not be made.
struct ListenerPort {
  std::shared_ptr<Listener> tcp{};
  std::shared_ptr<SerialListener> serial{};

  explicit operator bool() const { return tcp || serial; }
};

/// The origin of one entry of the new modbus.listen.
struct ListenerOrigin {
  std::optional<std::size_t> was;  ///< its index in the old list; empty: it is new
  bool same = false;               ///< it is unchanged, so its clients stay
  ListenerPort opened{};           ///< the opened port of a new entry, from ModbusServer::OpenPort

  /// True if the open port goes on. A serial port is closed and opened again if any setting
  /// differs.
  bool keeps_port(const config::Listener& now) const { return was && (same || !now.is_serial()); }
};

/// The listeners and routes that a reload leaves running. ModbusOutput fills it, ModbusServer
/// applies it.
struct Renewal {
  std::vector<ListenerOrigin> listeners;
  Origins routes;
  double client_share = 1;  ///< see ModbusLimits
};

class PassedSockets;

class ModbusServer {
 public:
  /// Store and sink must outlive the server, the configuration must stay valid until Listen. `info`
  /// is called on the server's thread when a client reads the gateway's status block.
  ModbusServer(const config::Config& config, const bus::PointStore& store, bus::CommandSink& sink,
               std::function<GatewayFigures()> info, ModbusLimits limits = {},
               const ModbusLinks& links = {});
  ~ModbusServer();
  ModbusServer(const ModbusServer&) = delete;
  ModbusServer& operator=(const ModbusServer&) = delete;

  /// Opens every port of modbus.listen, or none. The error is e.g. "127.0.0.1:1502: address already
  /// in use; …". A serial port that is absent is no error: it is opened when it appears.
  Status Listen(asio::io_context& io);

  // The steps of a reload: OpenPort for new entries, Apply, ClosePorts, Finish.

  /// Checks that the module for the listener's framing is loaded. The error is a reason without the
  /// listener's address, as that of OpenPort.
  Status CanServe(const config::Listener& listener) const;
  /// Makes the port of a new entry; may be called on any thread. TCP clients wait until the port is
  /// passed to Apply; if it is destroyed instead, it closes. A serial port is opened later, by
  /// Finish.
  Result<ListenerPort> OpenPort(const config::Listener& listener,
                                PassedSockets* passed = nullptr) const;
  using Ended = std::vector<std::shared_ptr<SerialListener>>;
  /// Renews units, points, lines and routes, by their indexes in the store; then listeners. Clients
  /// of listeners that changed or were removed are disconnected. A new entry without a port is
  /// tried each second. Returns the serial ports that have ended.
  Ended Apply(const config::Config& config, std::span<bus::RouteTarget* const> lines,
              const Renewal& renewal);
  /// Closes the serial ports that Apply returned; may be called on any thread. A driver may take
  /// long.
  static void ClosePorts(const Ended& ended);
  void Finish(Ended ended);
  /// The entries without a port, which are tried each second: "listener 0.0.0.0:502: address
  /// already in use; …".
  std::vector<std::string> Missing() const;

  /// Closes ports and clients. Writes under way continue; their answers are dropped.
  void Stop();

  /// The TCP port of the listener with this index in modbus.listen; 0 while closed, and for serial
  /// ports.
  std::uint16_t port(std::size_t listener = 0) const;
  /// E.g. "Modbus TCP on 0.0.0.0:502, a Modbus master on /dev/ttyS1"; empty: no port is open.
  std::string Summary() const;
  ModbusCounters counters() const { return shared_->counters().Snapshot(); }
  /// May be called on any thread.
  TrafficStatus Traffic() const;

 private:
  static constexpr Duration kTryEvery = 1s;

  struct Place {
    config::Listener listener;
    ListenerPort port{};
    std::string why_not{};  ///< why no client can connect; empty: clients can
    bool is_begun = false;
  };
  /// Tries to open missing ports, and checks that the addresses of open ports still exist on this
  /// machine. Called each second.
  void Look();
  Status LookAt(Place& place) const;
  void BeginTcp();
  void BeginSerial();
  static Ended End(std::vector<Place> places);

  const config::Config& config_;  // of the start
  std::unique_ptr<ServerShared> shared_;
  asio::io_context* io_ = nullptr;  // null: the server does not listen
  std::optional<asio::steady_timer> retry_;
  std::vector<Place> places_;  // in the order of modbus.listen
};

}  // namespace baudgate::modbus
