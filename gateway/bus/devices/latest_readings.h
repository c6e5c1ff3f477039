// The points that were read and stored since the line last rested for its longest reply time. If a
// reply comes twice, one of these readings may belong to another request; which is not known.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cstddef>
#include <utility>
#include <vector>

namespace baudgate {

class LatestReadings {
 public:
  /// Points of one query of a device.
  struct Points {
    std::size_t device = 0;  ///< its place
    std::vector<std::size_t> points{};
    bool operator==(const Points&) const = default;
  };

  void OnStored(Points read) {
    if (std::ranges::find(read_, read) == read_.end()) read_.push_back(std::move(read));
  }
  /// The line has rested: no reply to an earlier request is owed any more.
  void OnRested() { read_.clear(); }
  std::vector<Points> TakeAll() { return std::exchange(read_, {}); }

 private:
  std::vector<Points> read_;
};

}  // namespace baudgate
