// The points as they are now: what is news, and in which order they are shown. Events come from
// gateway/tools/watch/watch.h, rows go to the table. PointOrder is the order of a device's profile.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <istream>
#include <map>
#include <set>
#include <string>
#include <string_view>
#include <tuple>
#include <vector>

#include "gateway/base/time.h"
#include "gateway/tools/terminal/live_table.h"
#include "gateway/tools/watch/watch_lines.h"

namespace baudgate {

// The order in which the points of a device are shown: that of its profile. A sample does not name
// the profile: it is the one that has the most of the device's points. Read from a file that
// `baudgate watch` makes of the installed profiles: one a line, the names of its points, those that
// can only be written with a '-' in front.
//
//   current_l1 current_l2 current_l3 -reset
//
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

/// How much of an event is new to the image. Each value includes those before it.
enum class News : std::uint8_t {
  nothing,  ///< the same reading, sent once more
  reading,  ///< the same value and quality, read once more
  value,
  point,  ///< the first event of this point
};

class PointImage {
 public:
  explicit PointImage(PointOrder order) : order_(std::move(order)) {}

  News Put(const PointEvent& event);
  bool empty() const { return image_.empty(); }
  const PointOrder& order() const { return order_; }

  /// By gateway and device, and the points of each as its profile has them.
  std::vector<const PointEvent*> Ordered() const;
  /// The same for the table.
  std::vector<PointRow> Rows(WallTime now) const;

 private:
  using Key = std::tuple<std::string, std::string, std::string>;  // gateway, device, point

  const PointOrder order_;
  std::map<Key, PointEvent> image_;
};

}  // namespace baudgate
