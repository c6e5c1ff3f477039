// The queries whose readings were stored since the line last rested for its longest reply time. If
// a reply comes twice, one of these readings may belong to another request; which is not known.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <utility>
#include <vector>

#include "gateway/poll/schedule.h"

namespace baudgate {

class LatestReadings {
 public:
  void OnStored(QueryRef query) {
    if (std::ranges::find(queries_, query) == queries_.end()) queries_.push_back(query);
  }
  /// The line has rested: no reply to an earlier request is owed any more.
  void OnRested() { queries_.clear(); }
  std::vector<QueryRef> TakeAll() { return std::exchange(queries_, {}); }

 private:
  std::vector<QueryRef> queries_;
};

}  // namespace baudgate
