// `CompareModbus` compares modbus.listen and modbus.routes of two configurations. Listeners are
// matched by their address. Routes are matched by all their settings, else by all settings except
// `alarms` (in_place), else by units and target (restarted). The result is empty if Modbus is off
// in one of the configurations. Example (`was`: index in the running list):
//
//   running                        next                          result
//   127.0.0.1:1502                 127.0.0.1:1502 write: deny    restarted, was 0
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

enum class Action : std::uint8_t {
  same,       ///< the line, listener or route runs on unchanged
  in_place,   ///< the line or route runs on with the changed settings
  restarted,  ///< the line or route is restarted; a listener disconnects its clients
  added,
  removed,
};

struct ListenerChange {
  std::string place;  ///< the listener's address (config::Listener::Address())
  Action action = Action::same;
  std::string what;  ///< the settings that differ, e.g. "write, allow"
  /// Index in the running modbus.listen; nothing: the listener is new.
  std::optional<std::size_t> was;
  /// The number of clients that will be disconnected; nothing: the clients were not counted.
  std::optional<std::size_t> clients = {};
};

struct RouteChange {
  std::string route;  ///< e.g. "33-40 to drive"
  Action action = Action::same;
  std::string what;
  /// Index in the running modbus.routes. Nothing: the route is new, restarted or removed.
  std::optional<std::size_t> was;
};

struct ModbusDifference {
  std::vector<ListenerChange> listeners;
  std::vector<RouteChange> routes;
  bool route_order = false;  ///< the routes that remain have another order than before
  /// Sentences about listeners that need a restart of the gateway, because their port can be opened
  /// only after a removed listener's port is closed: "modbus.listen from 10.0.0.1:502 to
  /// 0.0.0.0:502".
  std::vector<std::string> restart;
};

ModbusDifference CompareModbus(const config::Modbus& running, const config::Modbus& next);

/// Returns e.g. "listener 127.0.0.1:1502: changed settings: write; its 3 clients are disconnected".
/// Empty if nothing changed.
std::string SentenceOf(const ListenerChange& change);
std::string SentenceOf(const RouteChange& change);

}  // namespace baudgate::reload
