// `ModbusServer` is the gateway's Modbus server: it serves the point store and passes writes to the
// lines. Its functions must be called on the thread that runs the io_context, or while no thread
// runs it, unless their comment allows other threads. Any thread may call `counters`. `Renewal`
// tells which listeners and routes a reload leaves unchanged.
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
/// not be created.
struct ListenerPort {
  std::shared_ptr<Listener> tcp{};
  std::shared_ptr<SerialListener> serial{};

  explicit operator bool() const { return tcp || serial; }
};

struct ListenerOrigin {
  /// Index of this entry in the old modbus.listen; nothing: the entry is new.
  std::optional<std::size_t> was;
  bool same = false;      ///< the entry is unchanged, so its clients stay connected
  ListenerPort opened{};  ///< the opened port of a new entry, from ModbusServer::OpenPort

  /// True if the entry takes over the open port of the old entry. A serial port is closed and
  /// opened again if any setting differs.
  bool keeps_port(const config::Listener& now) const { return was && (same || !now.is_serial()); }
};

/// Tells for each listener and route of a new configuration what it was before. ModbusOutput makes
/// a Renewal, and ModbusServer applies it.
struct Renewal {
  std::vector<ListenerOrigin> listeners;
  Origins routes;
  double client_share = 1;  ///< share of max_clients that can connect (ModbusLimits)
};

class PassedSockets;

class ModbusServer {
 public:
  /// `store` and `sink` must outlive the server, `config` must remain valid until Listen returns.
  /// `info` is called on the server's thread when a client reads the gateway's status block.
  ModbusServer(const config::Config& config, const bus::PointStore& store, bus::CommandSink& sink,
               std::function<GatewayFigures()> info, ModbusLimits limits = {},
               const ModbusLinks& links = {});
  ~ModbusServer();
  ModbusServer(const ModbusServer&) = delete;
  ModbusServer& operator=(const ModbusServer&) = delete;

  /// Opens all ports of modbus.listen; if one fails, opens none. The error is e.g. "127.0.0.1:1502:
  /// address already in use; …". A serial port that is absent, and files of TLS that cannot be
  /// used, are no errors: the port is opened when they are there.
  Status Listen(asio::io_context& io);

  // A reload calls in this order: OpenPort for new entries, Apply, ClosePorts, Finish.

  /// Checks that the protocol module of the listener's framing is loaded, and that its files of TLS
  /// can be used. The error does not contain the listener's address.
  Status CanServe(const config::Listener& listener) const;
  /// Makes the port of a new entry; any thread may call it. Clients that connect to a TCP port wait
  /// until Apply has taken the port. A port that is destroyed instead closes. Finish opens serial
  /// ports.
  Result<ListenerPort> OpenPort(const config::Listener& listener,
                                PassedSockets* passed = nullptr) const;
  using Ended = std::vector<std::shared_ptr<SerialListener>>;
  /// Replaces units, points, lines and routes, then the listeners. Clients of changed or removed
  /// listeners are disconnected. A TCP port that is not open is tried again each second. Returns
  /// the listeners whose serial ports must be closed (ClosePorts).
  Ended Apply(const config::Config& config, std::span<bus::RouteTarget* const> lines,
              const Renewal& renewal);
  /// Closes the serial ports that Apply returned, which can take long. Any thread may call it.
  static void ClosePorts(const Ended& ended);
  void Finish(Ended ended);
  /// Returns a sentence for each entry whose port is not open (it is tried again each second):
  /// "listener 0.0.0.0:502: address already in use; …".
  std::vector<std::string> Missing() const;

  /// Closes ports and clients. Writes in progress continue, but are not answered.
  void Stop();

  /// Returns the TCP port of the listener with this index in modbus.listen; 0: the port is closed,
  /// or the listener is serial.
  std::uint16_t port(std::size_t listener = 0) const;
  /// Returns e.g. "Modbus TCP on 0.0.0.0:502, a Modbus master on /dev/ttyS1"; empty: no port is
  /// open.
  std::string Summary() const;
  ModbusCounters counters() const { return shared_->counters().Snapshot(); }
  /// Returns the state of clients and routes. Any thread may call it.
  TrafficStatus Traffic() const;

 private:
  static constexpr Duration kTryEvery = 1s;

  struct Place {
    config::Listener listener;
    ListenerPort port{};
    std::string why_not{};  ///< why no client can connect; empty: clients can connect
    bool is_begun = false;
  };
  /// Tries to open missing ports, and checks that this machine still has the addresses of open
  /// ports. Runs each second.
  void Look();
  Status LookAt(Place& place) const;
  void BeginTcp();
  void BeginSerial();
  static Ended End(std::vector<Place> places);

  const config::Config& config_;
  std::unique_ptr<ServerShared> shared_;
  asio::io_context* io_ = nullptr;  // null: the server does not listen
  std::optional<asio::steady_timer> retry_;
  std::vector<Place> places_;  // in the order of modbus.listen
};

}  // namespace baudgate::modbus
