// The points as they are now: what is news, and in which order they are shown. Events come from
// gateway/tools/watch/watch.h, rows go to the table.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <tuple>
#include <vector>

#include "gateway/base/time.h"
#include "gateway/tools/terminal/live_table.h"
#include "gateway/tools/watch/point_order.h"
#include "gateway/tools/watch/watch_lines.h"

namespace baudgate {

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
