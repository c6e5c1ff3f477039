// What a reload leaves of the listeners and routes that run: the composition root says so, and
// modbus_server.cpp acts on it.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <memory>
#include <optional>
#include <vector>

#include "config/model/listener.h"
#include "gateway/outputs/modbus/service/route_list.h"

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

struct Renewal {
  std::vector<ListenerOrigin> listeners;
  Origins routes;
  double client_share = 1;  ///< see ModbusLimits
};

}  // namespace baudgate::modbus
