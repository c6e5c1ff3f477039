// Checks that the parts of a point fit together, and that its registers do not overlap those of the
// device's other points. ResolveSentinels checks the sentinels.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <map>
#include <string>
#include <vector>

#include "config/model/device.h"
#include "config/model/point.h"
#include "config/model/problem.h"
#include "protocols/protocol.h"

namespace baudgate::config {

/// Converts sentinels in hex to numbers, and reports sentinels that the device can never send or
/// that occur twice. Example: 0x8000 becomes -32768 if the protocol reads an int16, whatever the
/// type of the point is. If `protocol` is null, the type of the point decides.
void ResolveSentinels(Device& device, const protocols::Protocol* protocol, Problems& problems);

/// Checks one point. `keys` has the positions of the point's keys in the file, for messages. If
/// `protocol` is null, the protocol's own checks are left out.
void CheckPoint(const Point& point, const protocols::Protocol* protocol, const Keys& keys,
                Problems& problems);

/// Checks that the points named as `min` or `max` of other points can be limits: they are readable
/// numbers with the same unit.
void CheckLimitPoints(const std::vector<Point>& points, Problems& problems);

/// Checks the register tables of one device: points must lie in the areas of values
/// (config/model/modbus.h) and must not overlap.
class RegisterClaims {
 public:
  explicit RegisterClaims(Problems& problems) : problems_(problems) {}
  /// Adds a point, and reports problems with its addresses. `mark` is the position of the key
  /// `modbus` in the file.
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

  /// Key: the first address. A point that overlaps an earlier point is not added.
  std::map<int, Taken> registers_;
  std::map<int, Taken> bits_;
  /// The names of the points with a select register. Key: the address of the point.
  std::map<int, std::string> selects_;
  Problems& problems_;
};

}  // namespace baudgate::config
