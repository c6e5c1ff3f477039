// Whether the parts of a point fit together, and its registers beside those of its device's other
// points. Points come from the readers or from commands; what is wrong goes to Problems.
// ResolveSentinels checks the sentinels.
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

// Checks that a device can send the `sentinels` of its points. Where the protocol reads whole
// numbers, a sentinel must lie within their range, and a sentinel in hex stands for their bits.

/// Turns sentinels in hex into numbers, and reports sentinels that the device can never send or
/// that stand twice. Example: 0x8000 becomes -32768 if the protocol reads an int16, whatever the
/// type of the point is. Without a protocol the type of the point decides.
void ResolveSentinels(Device& device, const protocols::Protocol* protocol, Problems& problems);

/// `keys`: of the point, for the places of problems. Without a protocol what only it can judge is
/// left out.
void CheckPoint(const Point& point, const protocols::Protocol* protocol, const Keys& keys,
                Problems& problems);

/// Whether the points that stand as `min` or `max` of others can be limits.
void CheckLimitPoints(const std::vector<Point>& points, Problems& problems);

/// The register tables of one device: no point outside the areas of values
/// (config/model/modbus.h), and no two in one place.
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
