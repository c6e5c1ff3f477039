// How the points of a device are read: neighbours of one channel and category share a request.
// Points come from the profile, queries go to the poller through the conversation.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <set>
#include <span>
#include <vector>

#include "config/model/point.h"
#include "protocols/conversation.h"
#include "protocols/spabus/codec.h"
#include "protocols/spabus/points.h"

namespace baudgate::protocols::spabus {

/// What was learned of the device in this session.
struct Learned {
  std::size_t max_items = 8;  ///< in one request
  std::set<Address> cuts;     ///< a request never reaches from before such an item to it
  std::set<Address> missing;  ///< items that the device does not have; not asked for
};

/// What one query asks for: items `first` to `last` of one channel and category.
struct Block {
  Address first;
  std::uint32_t last = 0;
  std::size_t ItemCount() const { return first.number ? last - *first.number + 1 : 1; }
  /// The item where the second half of the block begins. Only of several items.
  Address Middle() const;
};

/// Parallel lists: what the poller asks, and what it means on the wire. Fast points come first.
struct Plan {
  std::vector<Query> queries;
  std::vector<Block> blocks;
};
Plan MakePlan(std::span<const ReadPoint> points, const Learned& learned);

}  // namespace baudgate::protocols::spabus
