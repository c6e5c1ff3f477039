// What no single value shows: registers that overlap, names and units given twice, times that
// contradict each other. Fed by the readers while they still know the places; results are problems.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <map>
#include <string>

#include "config/config.h"
#include "config/yaml_reader.h"

namespace baudgate::config {

/// Whether the parts of one point fit together. `map` still has the places of its keys.
void CheckPoint(const Point& point, const MapReader& map);

/// The register tables of one device: ranges, and no two points in one place.
class RegisterMap {
 public:
  explicit RegisterMap(Problems& problems) : problems_(problems) {}
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
  void Listener(const std::string& at, const Mark& mark);

 private:
  struct Owner {
    std::string name;
    Mark mark;
  };
  using Owners = std::map<std::string, Owner>;
  /// The first owner when there is one already.
  static const Owner* Claim(Owners& owners, const std::string& what, const std::string& name,
                            const Mark& mark);

  Owners lines_, devices_, units_, ports_, listeners_;
  Problems& problems_;
};

/// poll, slow, max_age, dead_age, and points that no one polls or serves.
void CheckDevice(const Device& device, const MapReader& map);
void CheckTiming(const Timing& timing, const Mark& mark, Problems& problems);
void CheckListener(const Listener& listener, Problems& problems);

}  // namespace baudgate::config
