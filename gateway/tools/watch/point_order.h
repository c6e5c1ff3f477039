// The order in which the points of a device are shown: that of its profile. A sample does not name
// the profile: it is the one that has the most of the device's points. Read from a file that
// `baudgate watch` makes of the installed profiles: one a line, the names of its points, those that
// can only be written with a '-' in front.
//
//   current_l1 current_l2 current_l3 -reset
//
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <istream>
#include <map>
#include <set>
#include <string>
#include <string_view>
#include <vector>

namespace baudgate {

class PointOrder {
 public:
  PointOrder() = default;
  explicit PointOrder(std::istream& profiles);

  /// Those of the profile first, the others behind them: input_2 stands before input_10.
  void Sort(std::vector<std::string>& points) const;
  /// In every profile that has a point of this name. Such a point never has a value.
  bool IsWriteOnly(const std::string& point) const { return write_only_.contains(point); }

 private:
  using Places = std::map<std::string, std::size_t>;  // of points in one profile

  const Places* ProfileOf(const std::vector<std::string>& points) const;

  std::vector<Places> profiles_;
  std::set<std::string> write_only_;
};

/// As people count: "input_2" before "input_10".
bool ComesBefore(std::string_view a, std::string_view b);

}  // namespace baudgate
