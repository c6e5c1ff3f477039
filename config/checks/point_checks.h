// Whether the parts of a point fit together, and its registers beside those of its device's other
// points. Points come from the readers or from commands; what is wrong goes to Problems.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <map>
#include <string>
#include <vector>

#include "config/model/mark.h"
#include "config/model/point.h"
#include "config/model/problem.h"
#include "protocols/protocol.h"

namespace baudgate::config {

/// `keys`: of the point, for the places of problems. Without a protocol what only it can judge is
/// left out.
void CheckPoint(const Point& point, const Protocol* protocol, const Keys& keys, Problems& problems);

/// Whether the points that stand as `min` or `max` of others can be limits.
void CheckLimitPoints(const std::vector<Point>& points, Problems& problems);

/// The register tables of one device: no point outside the areas of values
/// (config/model/modbus_addresses.h), and no two in one place.
class RegisterClaims {
 public:
  explicit RegisterClaims(Problems& problems) : problems_(problems) {}
  /// `mark`: of the point's `modbus`.
  void Add(const Point& point, const Mark& mark);

 private:
  void AddSelect(const Point& point, const Mark& mark);

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
  std::map<int, std::string> selects_;  ///< points that are selected, by their address
  Problems& problems_;
};

}  // namespace baudgate::config
