// What no single value shows: registers that overlap, names and units given twice, times that
// contradict each other, routes that lead nowhere. Fed by the readers while they still know the
// places; results are problems.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <map>
#include <string>
#include <vector>

#include "config/catalog.h"
#include "config/model/config.h"
#include "config/yaml/yaml_reader.h"

namespace baudgate::config {

/// Whether the parts of one point fit together. `map` still has the places of its keys.
void CheckPoint(const Point& point, const MapReader& map);

/// The register tables of one device: ranges, and no two points in one place.
class RegisterClaims {
 public:
  explicit RegisterClaims(Problems& problems) : problems_(problems) {}
  /// `mark`: of the point's `modbus`.
  void Add(const Point& point, const Mark& mark);

 private:
  struct Taken {
    int last = 0;
    std::string name;
    Mark mark;
  };
  std::map<int, Taken>& TableOf(const Point& point) {
    return point.table == Table::bits ? bits_ : registers_;
  }

  std::map<int, Taken> registers_;  ///< by first address; ranges never overlap
  std::map<int, Taken> bits_;
  Problems& problems_;
};

/// What must be unique in the whole gateway: who came first is named when somebody comes second.
class Uniques {
 public:
  explicit Uniques(Problems& problems) : problems_(problems) {}

  void Line(const std::string& name, const Mark& mark);
  void Device(const std::string& name, const Mark& mark);
  void Unit(std::uint8_t unit, const std::string& device, const Mark& mark);
  /// Links such as /dev/serial/by-id/… count as what they lead to.
  void Port(const std::string& port, const std::string& line, const Mark& mark);
  /// A serial port at which a master waits; in one table with the ports of lines.
  void ListenerPort(const std::string& path, const Mark& mark);
  /// No two at one port of one address; 0.0.0.0 and :: are all of them.
  void Listener(const config::Listener& listener);

 private:
  struct Owner {
    std::string name;
    Mark mark;
  };
  using Owners = std::map<std::string, Owner>;
  /// The first owner when there is one already.
  static const Owner* Claim(Owners& owners, const std::string& what, const std::string& name,
                            const Mark& mark);

  Owners lines_, devices_, units_, ports_;
  std::vector<config::Listener> listeners_;
  Problems& problems_;
};

/// poll, slow, max_age, dead_age, and points that no one polls or serves.
void CheckDevice(const Device& device, const MapReader& map);
void CheckTiming(const Timing& timing, const Mark& mark, Problems& problems);
/// Whether characters of the protocol fit into these. `mark`: of what chose the one or the other.
void CheckDataBits(const SerialSettings& serial, const Protocol& protocol, const Mark& mark,
                   Problems& problems);
/// What only a port of this machine can do. `mark`: of the settings.
void CheckPortSettings(const std::string& port, const SerialSettings& serial, const Mark& mark,
                       Problems& problems);
/// The protocol that makes and reads the frames of RTU masters.
inline constexpr const char* kRtuProtocol = "modbus_rtu";
void CheckListener(const Listener& listener, const Catalog& catalog, Problems& problems);
/// Whether the next entry of `listener.clients` can ever apply. `mark`: of its `from`.
void CheckClient(const ClientPriority& client, const Listener& listener, const Mark& mark,
                 Problems& problems);
/// Exactly one of `line` and `server`.
void CheckTarget(const MapReader& route);
/// Whether the addresses that the route's units come to exist where it leads.
void CheckRoute(const Route& route, const MapReader& map);
/// A route to one of our own listeners would never end. `mark`: of the route's `server`.
void CheckServer(const Route& route, const std::vector<Listener>& listeners, const Mark& mark,
                 Problems& problems);
/// Lines that nobody asks anything, broadcasts that reach no line.
void CheckUse(const Config& config, Problems& problems);

}  // namespace baudgate::config
