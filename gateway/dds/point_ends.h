// The points that nobody reads any more and whose end subscribers have to be told: the last value
// of each goes out once more, not connected. Pure; gateway/dds/notice_sender.h sends.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <deque>
#include <vector>

#include "config/model/config.h"
#include "gateway/dds/point_slots.h"
#include "gateway/dds/samples.h"
#include "gateway/store/change_feed.h"
#include "gateway/store/point_store.h"

namespace baudgate::dds {

class PointEnds {
 public:
  /// Both outlive this.
  PointEnds(const config::Config& config, const PointStore& store)
      : config_(config), store_(store) {}

  void Add(PointRef ref) { gone_.push_back(ref); }
  void Clear() { gone_.clear(); }
  /// A point that has come back under its name before its end was told has none. Returns the slots
  /// of these points.
  std::vector<std::uint32_t> TakeBack(const PointSlots& slots);

  bool empty() const { return gone_.empty(); }
  /// The one to be sent; null: none now. The same until OnSent.
  const PointSample* Next();
  void OnSent() { gone_.pop_front(); }

 private:
  const config::Config& config_;
  const PointStore& store_;
  std::deque<PointRef> gone_;
  PointSample sample_;  ///< of the first
};

}  // namespace baudgate::dds
