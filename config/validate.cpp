// SPDX-License-Identifier: Apache-2.0
#include "config/validate.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <limits>

#include "config/network.h"
#include "gateway/base/spelling.h"
#include "gateway/base/text.h"

namespace baudgate::config {
namespace {

constexpr int kLastSlave = 247;

bool IsFloat(Type type) { return type == Type::float32 || type == Type::float64; }

/// Whether a register of this type can hold the number.
bool Fits(Type type, double number) {
  if (type == Type::float32) return std::abs(number) <= std::numeric_limits<float>::max();
  if (type == Type::float64) return true;
  return number == std::trunc(number) && RangeOf(type).Contains(number);
}

void CheckOnFault(const Point& point, const Mark& mark, Problems& problems) {
  const std::string type(Name(point.type));
  if (point.on_fault.kind == OnFault::Kind::nan && !IsFloat(point.type)) {
    problems.Error(mark, "on_fault: nan needs a float type, and '" + point.name + "' is " + type +
                             "; write hold or a number");
  }
  if (point.on_fault.kind != OnFault::Kind::value) return;
  const double value = point.on_fault.value;
  if (point.type == Type::string || !Fits(point.type, value)) {
    problems.Error(mark, "on_fault: " + FormatNumber(value) + " does not fit type " + type);
  }
}

void CheckArithmetic(const Point& point, const MapReader& map, Problems& problems) {
  const bool is_number = point.type != Type::string && point.type != Type::boolean;
  if (point.scale == 0) {
    problems.Error(map.MarkOf("scale"), "scale: 0 would make every value the same");
  }
  if (!is_number && point.scale != 1) {
    problems.Error(map.MarkOf("scale"), "scale: only numbers can be scaled, and '" + point.name +
                                            "' is " + std::string(Name(point.type)));
  }
  if (!is_number && point.offset != 0) {
    problems.Error(map.MarkOf("offset"), "offset: only numbers have one, and '" + point.name +
                                             "' is " + std::string(Name(point.type)));
  }
  if (point.deadband < 0) {
    problems.Error(map.MarkOf("deadband"), "deadband: must not be negative");
  }
  if (point.type == Type::string && !point.sentinels.empty()) {
    problems.Error(map.MarkOf("sentinels"), "sentinels: a string has none");
  }
}

std::string Range(int first, int last) {
  if (first == last) return std::to_string(first);
  return std::to_string(first) + "…" + std::to_string(last);
}

constexpr std::string_view kTcp = "tcp://";

std::string RealPort(const std::string& port) {
  if (port.starts_with(kTcp)) {
    const auto at = ParseHostPort(port.substr(kTcp.size()));
    if (!at) return port;
    const std::string host = IsIpAddress(at->host) ? Canonical(at->host) : Lower(at->host);
    return std::string(kTcp) + host + ":" + std::to_string(at->port);
  }
  std::error_code error;
  const auto canonical = std::filesystem::weakly_canonical(port, error);
  return error ? port : canonical.string();
}

bool IsEverywhere(const std::string& host) { return host == "0.0.0.0" || host == "::"; }

bool InAllowedRange(int first, int last) {
  return last <= 8999 || (first >= 9100 && last <= 19999);
}

}  // namespace

void CheckPoint(const Point& point, const MapReader& map) {
  Problems& problems = map.problems();
  if (point.table == Table::bits && point.type != Type::boolean) {
    problems.Error(map.MarkOf("table"), "table: only bool points fit a bit table, and '" +
                                            point.name + "' is " + std::string(Name(point.type)) +
                                            "; write table: input");
  }
  if (!point.write.empty() && point.access == Access::read) {
    problems.Error(map.MarkOf("write"),
                   "write: '" + point.name + "' is read-only; add access: rw or remove 'write'");
  }
  if (point.simulate && point.simulate->text && point.simulate->text->size() > point.text_length &&
      point.text_length > 0) {
    problems.Error(map.MarkOf("simulate"), "simulate: the text is longer than string(" +
                                               std::to_string(point.text_length) + ")");
  }
  CheckArithmetic(point, map, problems);
  CheckOnFault(point, map.MarkOf("on_fault"), problems);
}

void RegisterClaims::Add(const Point& point, const Mark& mark) {
  if (!point.modbus) return;
  const int first = *point.modbus;
  const int count = point.table == Table::bits ? 1 : static_cast<int>(RegisterCount(point));
  const int last = first + count - 1;
  const std::string kind = point.table == Table::bits ? "bit " : "register ";
  if (!InAllowedRange(first, last)) {
    problems_.Error(mark, "modbus: " + kind + Range(first, last) + " of '" + point.name +
                              "' is reserved; points live at 0…8999 and 9100…19999");
    return;
  }
  auto& table = TableOf(point);
  auto next = table.upper_bound(first);
  const Taken* other = nullptr;
  int other_first = 0;
  if (next != table.begin() && std::prev(next)->second.last >= first) --next;
  if (next != table.end() && next->first <= last) {
    other = &next->second;
    other_first = next->first;
  }
  if (!other) {
    table.emplace(first, Taken{last, point.name, mark});
    return;
  }
  problems_.Error(mark, "modbus: " + kind + Range(first, last) + " of '" + point.name +
                            "' overlaps " + Range(other_first, other->last) + " of '" +
                            other->name + "' (" + other->mark.ToString() + ")");
}

const Uniques::Owner* Uniques::Claim(Owners& owners, const std::string& what,
                                     const std::string& name, const Mark& mark) {
  const auto [owner, is_new] = owners.emplace(what, Owner{name, mark});
  return is_new ? nullptr : &owner->second;
}

void Uniques::Line(const std::string& name, const Mark& mark) {
  if (const Owner* first = Claim(lines_, name, name, mark)) {
    problems_.Error(mark, "line name '" + name + "' is taken; first in line " +
                              std::to_string(first->mark.line) + " of the file");
  }
}

void Uniques::Device(const std::string& name, const Mark& mark) {
  if (const Owner* first = Claim(devices_, name, name, mark)) {
    problems_.Error(mark, "device name '" + name + "' is taken; first in line " +
                              std::to_string(first->mark.line) + " of the file");
  }
}

void Uniques::Unit(std::uint8_t unit, const std::string& device, const Mark& mark) {
  if (const Owner* first = Claim(units_, std::to_string(unit), device, mark)) {
    problems_.Error(mark, "unit: " + std::to_string(unit) + " is taken by device '" + first->name +
                              "' (line " + std::to_string(first->mark.line) + ")");
  }
}

void Uniques::Port(const std::string& port, const std::string& line, const Mark& mark) {
  if (const Owner* first = Claim(ports_, RealPort(port), "line '" + line + "'", mark)) {
    problems_.Error(mark, "port: " + Quoted(port) + " is already the port of " + first->name +
                              "; put the devices on one line");
  }
}

void Uniques::ListenerPort(const std::string& path, const Mark& mark) {
  if (const Owner* first = Claim(ports_, RealPort(path), "another listener", mark)) {
    problems_.Error(mark, "listen: " + Quoted(path) + " is already the port of " + first->name +
                              " (line " + std::to_string(first->mark.line) +
                              "); a master needs a port of its own");
  }
}

void Uniques::Listener(const config::Listener& listener) {
  const Network reach = ReachOf(listener.host);
  for (const config::Listener& first : listeners_) {
    const Network other = ReachOf(first.host);
    if (first.port != listener.port || !(Covers(other, reach) || Covers(reach, other))) continue;
    const std::string line = " in line " + std::to_string(first.mark.line);
    problems_.Error(listener.mark,
                    "listen: " + listener.Place() +
                        (first.Place() == listener.Place()
                             ? " stands twice; first" + line
                             : " and " + first.Place() + line +
                                   " want the same port; remove one, or give it another port"));
    return;
  }
  listeners_.push_back(listener);
}

void CheckDevice(const Device& device, const MapReader& map) {
  Problems& problems = map.problems();
  if (!map.Has("profile") && !map.Has("points")) {
    problems.Warning(device.mark, map.what() +
                                      " has no points: nothing will be read from it; "
                                      "give it a profile or points");
  }
  const Duration max_age = device.max_age.value_or(3 * device.poll);
  if (max_age < device.poll) {
    problems.Error(map.MarkOf("max_age"),
                   "max_age: " + FormatDuration(max_age) + " is shorter than poll (" +
                       FormatDuration(device.poll) + "): every value would be stale");
  }
  if (device.dead_age && *device.dead_age < max_age) {
    problems.Error(map.MarkOf("dead_age"), "dead_age: " + FormatDuration(*device.dead_age) +
                                               " is shorter than max_age (" +
                                               FormatDuration(max_age) + ")");
  }
  const bool has_slow = std::any_of(device.points.begin(), device.points.end(),
                                    [](const Point& p) { return p.group == Group::slow; });
  if (device.max_age && has_slow && *device.max_age < device.slow && max_age >= device.poll) {
    problems.Warning(map.MarkOf("max_age"),
                     "max_age: " + FormatDuration(max_age) + " is shorter than slow (" +
                         FormatDuration(device.slow) + "): slow points will often be uncertain");
  }
}

void CheckTiming(const Timing& timing, const Mark& mark, Problems& problems) {
  if (timing.ceiling && timing.reply && *timing.ceiling < *timing.reply) {
    problems.Error(mark, "timing: ceiling " + FormatDuration(*timing.ceiling) +
                             " is shorter than reply " + FormatDuration(*timing.reply) +
                             "; it covers the whole exchange");
  }
}

void CheckDataBits(const SerialSettings& serial, const Protocol& protocol, const Mark& mark,
                   Problems& problems) {
  if (serial.data_bits >= protocol.data_bits) return;
  SerialSettings wide = serial;
  wide.data_bits = 8;
  problems.Error(mark, "serial: " + std::string(protocol.name) + " needs 8 data bits, and " +
                           serial.ToString() + " has 7; write for example " + wide.ToString());
}

void CheckPortSettings(const std::string& port, const SerialSettings& serial, const Mark& mark,
                       Problems& problems) {
  if (!port.starts_with(kTcp)) return;
  for (const auto& [key, used] :
       {std::pair("rs485", serial.rs485.enabled), std::pair("rtscts", serial.rtscts)}) {
    if (!used) continue;
    problems.Error(mark, std::string(key) +
                             ": a serial server (tcp://) does this by itself; set it there and "
                             "remove the key");
  }
}

void CheckListener(const Listener& listener, const Catalog& catalog, Problems& problems) {
  if (listener.protocol == Listener::Protocol::rtu && !catalog.FindProtocol(kRtuProtocol)) {
    const auto installed = catalog.ProtocolNames();
    problems.Error(listener.mark, "listen: rtu needs the protocol '" + std::string(kRtuProtocol) +
                                      "', which is not "
                                      "installed; installed: " +
                                      (installed.empty() ? "none" : Join(installed)));
  }
  if (listener.is_serial() || listener.allow.empty()) return;
  const Network reach = ReachOf(listener.host);
  const bool can_come = std::any_of(
      listener.allow.begin(), listener.allow.end(),
      [&](const Network& network) { return IsLoopback(network) || Covers(network, reach); });
  if (IsLoopback(reach) && !can_come) {
    problems.Warning(listener.mark, "listen: " + listener.Place() +
                                        " takes connections from this machine only, and 'allow' "
                                        "has only others: nobody can come in; write for example "
                                        "at: \"0.0.0.0:" +
                                        std::to_string(listener.port) + "\"");
  }
  if (!IsEverywhere(listener.host)) return;
  if (std::all_of(listener.allow.begin(), listener.allow.end(), IsLoopback)) {
    problems.Warning(listener.mark, "listen: " + listener.host +
                                        " takes connections from everywhere, but 'allow' has only "
                                        "loopback; write 127.0.0.1 or allow the masters' network");
  }
}

void CheckClient(const ClientPriority& client, const Listener& listener, const Mark& mark,
                 Problems& problems) {
  const Network& from = client.from;
  for (const ClientPriority& earlier : listener.clients) {
    if (!Covers(earlier.from, from)) continue;
    problems.Warning(mark, "from: " + from.text + " has no effect: " + earlier.from.text +
                               " stands first and covers it");
    return;
  }
  const bool can_come = std::any_of(
      listener.allow.begin(), listener.allow.end(),
      [&](const Network& network) { return Covers(network, from) || Covers(from, network); });
  if (!listener.allow.empty() && !can_come) {
    problems.Warning(mark, "from: " + from.text + " has no effect: 'allow' lets nobody of it in");
  }
}

void CheckTarget(const MapReader& route) {
  const bool line = route.Has("line");
  if (line != route.Has("server")) return;
  if (line) {
    route.problems().Error(route.MarkOf("server"),
                           "server: the route has a line already; remove one of the two keys");
  } else {
    route.problems().Error(route.mark(),
                           "a route needs 'line' or 'server'; for example line: drive or "
                           "server: \"10.0.0.9:502\"");
  }
}

void CheckRoute(const Route& route, const MapReader& map) {
  const bool to_line = map.Has("line");
  const int most = to_line ? kLastSlave : 255;
  if (!route.remap) {
    if (route.last <= most) return;
    map.problems().Error(map.MarkOf("units"),
                         "units: " + route.Units() +
                             " goes beyond 247, the last slave of a line; end there, or say with "
                             "remap which slave is the first, for example remap: 1");
    return;
  }
  const int first = *route.remap;
  const int last = first + route.last - route.first;
  if (first == route.first) {
    map.problems().Error(map.MarkOf("remap"),
                         "remap: " + std::to_string(first) + " changes nothing; remove the key");
  } else if (first < 1 || last > most) {  // 0 would be a broadcast
    map.problems().Error(map.MarkOf("remap"),
                         "remap: " + route.Units() + " would become " + Range(first, last) + "; " +
                             (to_line ? "slaves of a line are 1…247" : "unit ids are 1…255"));
  }
}

void CheckServer(const Route& route, const std::vector<Listener>& listeners, const Mark& mark,
                 Problems& problems) {
  const auto network = ParseNetwork(route.host);
  const bool here = network && IsLoopback(*network);
  for (const Listener& listener : listeners) {
    if (listener.is_serial() || listener.port != route.port) continue;
    if (listener.host != route.host && !(here && IsEverywhere(listener.host))) continue;
    problems.Error(mark, "server: " + listener.Place() +
                             " is this gateway itself: its requests would go in a circle; name the "
                             "line, or another server");
    return;
  }
}

void CheckUse(const Config& config, Problems& problems) {
  const auto& routes = config.modbus.routes;
  for (const Line& line : config.lines) {
    const bool routed = std::any_of(routes.begin(), routes.end(), [&](const Route& route) {
      return !route.line.empty() && route.line == line.name;
    });
    if (routed || !line.devices.empty()) continue;
    problems.Warning(line.mark, (line.name.empty() ? "line" : "line '" + line.name + "'") +
                                    " has no devices, and no route leads to it: nothing is asked "
                                    "on it");
  }
  if (std::any_of(routes.begin(), routes.end(), [](const Route& r) { return !r.line.empty(); })) {
    return;
  }
  for (const Listener& listener : config.modbus.listen) {
    if (listener.broadcast != Listener::Broadcast::pass) continue;
    problems.Warning(listener.mark,
                     "listen: broadcast: pass has no effect: no route leads to a "
                     "line");
  }
}

}  // namespace baudgate::config
