// Which points of a device were answered since it was connected. It decides one question: does
// silence to a request say something about the device, or about the points that were asked for?
// Many devices are silent to points that they do not have.
//
//   p was answered, q never; p is answered at 1 s
//   silence to p at 2 s     about the device
//   silence to q at 2 s     about q
//   silence to q at 12 s    about the device: it has not answered anything for 10 s
//   a late reply            for ten minutes silence may be lateness: about the device
//
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <optional>
#include <vector>

#include "gateway/base/time.h"

namespace baudgate {

class HeardPoints {
 public:
  /// It may be another device now.
  void Clear() {
    heard_.clear();
    last_.reset();
    late_.reset();
  }
  void OnLate(Instant now) { late_ = now; }
  void OnValue(std::size_t point, Instant now) {
    if (heard_.size() <= point) heard_.resize(point + 1);
    heard_[point] = true;
    last_ = now;
  }
  bool TellsOfDevice(const std::vector<std::size_t>& points, Instant now) const {
    if (!last_ || now - *last_ > kTrusted) return true;
    if (late_ && now - *late_ < kLate) return true;
    return std::ranges::any_of(
        points, [this](std::size_t point) { return point < heard_.size() && heard_[point]; });
  }

 private:
  static constexpr Duration kTrusted = 10s;
  static constexpr Duration kLate = 10min;

  std::vector<bool> heard_;
  std::optional<Instant> last_;
  std::optional<Instant> late_;
};

}  // namespace baudgate
