// What a new configuration changes of modbus.listen and modbus.routes. Pure. Listeners are compared
// by their place, routes as a whole; nothing of a Modbus output that is off.
//
//   running                        next                          comes out
//   127.0.0.1:1502                 127.0.0.1:1502 write: deny    changed, was 0
//   10.0.0.1:502                   10.0.0.1:502                  same, was 1
//   10.0.0.1:503                                                 removed
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "config/model/outputs.h"

namespace baudgate::reload {

// What a reload does to one part of the gateway: a line, a listener or a route.
enum class Action : std::uint8_t {
  same,       ///< it goes on, untouched
  in_place,   ///< it goes on with what has changed
  restarted,  ///< a line is restarted; a listener loses its clients
  added,
  removed,
};

struct ListenerChange {
  std::string place;  ///< config::Listener::Place()
  Action action = Action::same;
  std::string what;                         ///< "write, allow"; of a changed one
  std::optional<std::size_t> was;           ///< where it stands in the list that runs
  std::optional<std::size_t> clients = {};  ///< that it loses, if somebody has counted them
};

struct RouteChange {
  std::string route;  ///< "33-40 to drive"
  Action action = Action::same;
  std::string what;                ///< "remap"; of a changed one
  std::optional<std::size_t> was;  ///< where it stands in the list that runs; none: it begins
};

struct ModbusDifference {
  // All of the new configuration in its order, then those removed.
  std::vector<ListenerChange> listeners;
  std::vector<RouteChange> routes;
  bool route_order = false;  ///< routes that are the same stand in another order
  /// Ports that can only be opened after another is closed: "modbus.listen from 10.0.0.1:502 to
  /// 0.0.0.0:502".
  std::vector<std::string> restart;
};

ModbusDifference CompareModbus(const config::Modbus& running, const config::Modbus& next);

/// "listener 127.0.0.1:1502: differs in write; its 3 clients are disconnected"; same: nothing.
std::string SentenceOf(const ListenerChange& change);
/// "route 33-40 to drive: is new"
std::string SentenceOf(const RouteChange& change);

}  // namespace baudgate::reload
