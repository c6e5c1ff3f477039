// How the points of a device are read: items with consecutive numbers share a request, or else the
// same item of consecutive channels. Points come from the profile, queries go to the poller through
// the conversation.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <span>

#include "protocols/common/query_plan.h"
#include "protocols/spabus/codec.h"
#include "protocols/spabus/points.h"

namespace baudgate::protocols::spabus {

/// Items of one category that one request may read: 1I1, 1I2, 1I3 of channel 1, or across channels
/// 1I1, 2I1, 3I1. Places in it are numbers, or channels.
struct Row {
  char category = 'I';
  bool across = false;
  std::uint32_t common = 0;  ///< the channel of all; across channels the number of all
  bool operator==(const Row&) const = default;
};
using ItemPlan = QueryPlan<Row>;

/// What the device takes in one request, as far as it is known.
struct RequestLimits {
  std::size_t items = 8;
  bool channels = true;     ///< a range of them
  std::size_t written = 1;  ///< items in one write
};

/// One request takes items without a gap. `limits` are read whenever requests are laid out, so that
/// the device can be asked for less from now on; they outlive the plan.
ItemPlan MakePlan(std::span<const ReadPoint> points, const RequestLimits& limits,
                  Often is_often = IsFast);

/// The request that reads a block: >1RI1/5: or >1R1/3I1:
Command ReadOf(unsigned slave, const Block<Row>& block);

}  // namespace baudgate::protocols::spabus
