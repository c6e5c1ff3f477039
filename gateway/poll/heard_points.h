// Which points of a device were answered since it was connected, for one question: does silence to
// a request tell of the device, or of what was asked? Many devices are silent to what they do not
// have.
//
//   p was answered, q never; p is answered at 1 s
//   silence to p at 2 s     of the device
//   silence to q at 2 s     of q
//   silence to q at 12 s    of the device: nothing of it has come for long
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
  }
  void OnValue(std::size_t point, Instant now) {
    if (heard_.size() <= point) heard_.resize(point + 1);
    heard_[point] = true;
    last_ = now;
  }
  bool TellsOfDevice(const std::vector<std::size_t>& points, Instant now) const {
    if (!last_ || now - *last_ > kTrusted) return true;
    return std::ranges::any_of(
        points, [this](std::size_t point) { return point < heard_.size() && heard_[point]; });
  }

 private:
  static constexpr Duration kTrusted = 10s;

  std::vector<bool> heard_;
  std::optional<Instant> last_;
};

}  // namespace baudgate
