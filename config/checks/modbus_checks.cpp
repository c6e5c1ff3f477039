// SPDX-License-Identifier: Apache-2.0
#include "config/checks/modbus_checks.h"

#include <algorithm>

#include "config/model/config.h"
#include "config/model/network.h"
#include "gateway/base/text.h"

namespace baudgate::config {

void CheckListener(const Listener& listener, const Catalog& catalog, Problems& problems) {
  if (listener.speaks_serial() && !catalog.FramesOf(listener.framing)) {
    const auto installed = catalog.ProtocolNames();
    problems.Error(listener.mark, "listen: " + std::string(Name(listener.framing)) +
                                      " needs a protocol that makes " +
                                      std::string(Title(listener.framing)) +
                                      " frames, but none is installed; installed: " +
                                      (installed.empty() ? "none" : Join(installed)));
  }
  if (listener.is_serial() || listener.allow.empty()) return;
  const Network reach = ReachOf(listener.host);
  const bool can_come = std::any_of(
      listener.allow.begin(), listener.allow.end(),
      [&](const Network& network) { return IsLoopback(network) || Covers(network, reach); });
  if (IsLoopback(reach) && !can_come) {
    problems.Warning(
        listener.mark,
        "listen: " + listener.Address() +
            " accepts connections from this machine only, but 'allow' lists only other machines, "
            "so no client can connect; write for example at: \"0.0.0.0:" +
            std::to_string(listener.port) + "\"");
  }
  if (!IsEverywhere(listener.host)) return;
  if (std::all_of(listener.allow.begin(), listener.allow.end(), IsLoopback)) {
    problems.Warning(listener.mark,
                     "listen: " + listener.host +
                         " accepts connections from all machines, but 'allow' lists only loopback; "
                         "listen on 127.0.0.1, or allow the masters' network");
  }
}

void CheckClient(const ClientPriority& client, const Listener& listener, const Mark& mark,
                 Problems& problems) {
  const Network& from = client.from;
  for (const ClientPriority& earlier : listener.clients) {
    if (!Covers(earlier.from, from)) continue;
    problems.Warning(mark, "from: " + from.text + " has no effect, because the earlier entry " +
                               earlier.from.text + " covers it; put the narrower entry first");
    return;
  }
  const bool can_come = std::any_of(
      listener.allow.begin(), listener.allow.end(),
      [&](const Network& network) { return Covers(network, from) || Covers(from, network); });
  if (!listener.allow.empty() && !can_come) {
    problems.Warning(mark, "from: " + from.text +
                               " has no effect, because 'allow' excludes all of these addresses; "
                               "add them to 'allow', or remove the entry");
  }
}

namespace {

/// Returns the units that the route does not get, with their owners: "33-35 by the route in line 5,
/// 36 by device 'feeder-1'". Users write a wide route behind single units and devices on purpose.
/// So if the route gets some units, the text names only earlier routes that are not wholly inside
/// it.
std::string TakenOf(const Config& config, const std::vector<UnitSet>& reached, std::size_t index) {
  const UnitSet wanted = UnitsOf(config.modbus.routes[index]);
  const bool unused = reached[index].none();
  std::string text;
  const auto add = [&](const UnitSet& units, const std::string& owner) {
    if (units.none()) return;
    text += (text.empty() ? "" : ", ") + UnitsText(units) + " by " + owner;
  };
  for (const Line& line : config.lines) {
    for (const Device& device : line.devices) {
      if (unused && device.unit && wanted[*device.unit]) {
        add(UnitSet().set(*device.unit), "device '" + device.name + "'");
      }
    }
  }
  for (std::size_t i = 0; i < index; ++i) {
    const bool inside = (UnitsOf(config.modbus.routes[i]) & ~wanted).none();
    if (inside && !unused) continue;
    add(wanted & reached[i],
        "the route in line " + std::to_string(config.modbus.routes[i].mark.line));
  }
  return text;
}

void CheckDeadline(const Route& route, const Config& config, const Catalog& catalog,
                   Problems& problems) {
  if (route.line.empty()) return;
  const Line& line = config.lines[route.line_index];
  const protocols::Protocol* protocol = catalog.FindProtocol(line.protocol);
  if (!protocol) return;
  const Duration reply = *Resolve(line.timing, protocol->timing(line.serial)).reply;
  if (route.deadline >= reply) return;
  problems.Warning(route.mark, "route for " + route.Units() + ": deadline " +
                                   FormatDuration(route.deadline) +
                                   " is shorter than the reply timeout of line '" + line.name +
                                   "' (" + FormatDuration(reply) +
                                   "), so slow replies would come too late; lengthen the deadline, "
                                   "or shorten the line's timing: { reply: … }");
}

}  // namespace

void CheckTarget(const Keys& route, Problems& problems) {
  const bool line = route.Has("line");
  if (line != route.Has("server")) return;
  if (line) {
    problems.Error(route.MarkOf("server"),
                   "server: the route already has a line; remove line or server");
  } else {
    problems.Error(route.map,
                   "a route needs 'line' or 'server'; for example line: drive or "
                   "server: \"10.0.0.9:502\"");
  }
}

void CheckRoute(const Route& route, const Keys& keys, Problems& problems) {
  if (!route.remap) return;
  const bool to_line = keys.Has("line");
  const int least = to_line ? 1 : 0;  // address 0 would be a broadcast
  const int first = *route.remap;
  const int last = first + route.last - route.first;
  if (first == route.first && first > 0) {
    problems.Error(keys.MarkOf("remap"),
                   "remap: " + std::to_string(first) + " changes nothing; remove the key");
  } else if (first < least || last > 255) {
    problems.Error(keys.MarkOf("remap"),
                   "remap: " + route.Units() + " would become " + RangeText(first, last) +
                       ", but " +
                       (to_line ? "slave numbers on a line are 1…255" : "unit ids are 0…255") +
                       "; correct remap");
  }
}

void CheckServer(const Route& route, const std::vector<Listener>& listeners, const Mark& mark,
                 Problems& problems) {
  const auto network = ParseNetwork(route.host);
  const bool here = network && IsLoopback(*network);
  for (const Listener& listener : listeners) {
    if (listener.is_serial() || listener.port != route.port) continue;
    if (listener.host != route.host && !(here && IsEverywhere(listener.host))) continue;
    problems.Error(mark, "server: " + listener.Address() +
                             " is this gateway itself, so requests would return to it; name a "
                             "line, or another server");
    return;
  }
}

void CheckOpenListeners(const Config& config, Problems& problems) {
  const bool has_targets =
      !config.modbus.routes.empty() || std::ranges::any_of(config.lines, [](const Line& line) {
        return std::ranges::any_of(line.devices, [](const Device& device) {
          return std::ranges::any_of(device.points,
                                     [](const Point& point) { return point.writing.allowed; });
        });
      });
  if (!config.modbus.enabled || !has_targets) return;
  for (const Listener& listener : config.modbus.listen) {
    const bool is_open = !listener.is_serial() && listener.permit != Permit::read &&
                         listener.protocol == Listener::Protocol::tcp && listener.allow.empty() &&
                         !IsLoopback(ReachOf(listener.host));
    if (!is_open) continue;
    problems.Warning(listener.mark, "listen: every machine that reaches " + listener.Address() +
                                        " can write; add for example allow: [10.0.0.7], or write: "
                                        "deny. If this is meant, add allow: everybody");
  }
}

void CheckRoutes(const Config& config, const Catalog& catalog, Problems& problems) {
  const auto reached = RouteUnits(config);
  for (std::size_t i = 0; i < reached.size(); ++i) {
    const Route& route = config.modbus.routes[i];
    CheckDeadline(route, config, catalog, problems);
    const std::string taken = TakenOf(config, reached, i);
    if (taken.empty()) continue;
    problems.Warning(route.mark,
                     "route for " + route.Units() +
                         (reached[i].none()
                              ? " is never used, because its units are already used: "
                              : " does not get all of its units, because some are already used: ") +
                         taken);
  }
}

void CheckUse(const Config& config, Problems& problems) {
  const auto& routes = config.modbus.routes;
  for (const Line& line : config.lines) {
    const bool routed = std::any_of(routes.begin(), routes.end(), [&](const Route& route) {
      return !route.line.empty() && route.line == line.name;
    });
    if (routed && line.serial_server) {
      problems.Error(line.serial_server->mark,
                     "serial_server: a route leads to line '" + line.name +
                         "', but serial_server needs the port for itself; remove the route, or use "
                         "lend instead of serial_server");
    }
    if (routed || !line.devices.empty() || line.serial_server) continue;
    problems.Warning(line.mark, (line.name.empty() ? "line" : "line '" + line.name + "'") +
                                    " has no devices and no route leads to it, so it is not used; "
                                    "add devices or a route, or remove the line");
  }
  const auto takes_broadcasts = [](const Route& route) {
    return !route.line.empty() || (route.first == 0 && !route.remap);
  };
  if (std::any_of(routes.begin(), routes.end(), takes_broadcasts)) return;
  for (const Listener& listener : config.modbus.listen) {
    if (listener.broadcast != Listener::Broadcast::pass) continue;
    problems.Warning(listener.mark,
                     "listen: broadcast: pass has no effect, because no route leads to a line or "
                     "names unit 0; remove broadcast, or add a route");
  }
}

}  // namespace baudgate::config
