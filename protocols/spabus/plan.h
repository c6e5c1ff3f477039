// How the points of a device are read: items with consecutive numbers share a request.
// Points come from the profile, queries go to the poller through the conversation.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>

#include "protocols/common/query_plan.h"
#include "protocols/spabus/codec.h"
#include "protocols/spabus/points.h"

namespace baudgate::protocols::spabus {

/// The items of one channel and category, told apart by their numbers: 1I1, 1I2, 1I3.
struct Row {
  unsigned channel = 0;
  char category = 'I';
  bool operator==(const Row&) const = default;
};
using ItemPlan = QueryPlan<Row>;

/// One request takes items without a gap, and at most `most_items` of them: read whenever requests
/// are laid out, so that the device can be asked for less from now on; it outlives the plan.
ItemPlan MakePlan(std::span<const ReadPoint> points, const std::size_t& most_items);

/// The request that reads a block: >1RI1/5:
Command ReadOf(unsigned slave, const Block<Row>& block);

}  // namespace baudgate::protocols::spabus
