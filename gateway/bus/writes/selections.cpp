// SPDX-License-Identifier: Apache-2.0
#include "gateway/bus/writes/selections.h"

#include <algorithm>

namespace baudgate {

void Selections::Select(std::uint64_t client, Point point, Instant until) {
  until_[{point, client}] = until;
  if (until_.size() <= kLimit) return;
  until_.erase(std::ranges::min_element(until_, {}, [](const auto& one) { return one.second; }));
}

Selections::Verdict Selections::Take(std::uint64_t client, Point point, Instant now) {
  const auto own = until_.find({point, client});
  if (own != until_.end()) {
    const bool in_time = now < own->second;
    until_.erase(own);
    return in_time ? Verdict::selected : Verdict::expired;
  }
  for (auto one = until_.lower_bound({point, 0}); one != until_.end(); ++one) {
    if (one->first.point != point) break;
    if (now < one->second) return Verdict::foreign;
  }
  return Verdict::none;
}

void Selections::Forget(std::uint64_t client) {
  std::erase_if(until_, [client](const auto& one) { return one.first.client == client; });
}

}  // namespace baudgate
