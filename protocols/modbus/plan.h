// Plans the requests that read a device's points. Neighbouring points of one table share a request,
// which also reads the registers between them, up to the limits of the options.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "config/model/point.h"
#include "gateway/base/bytes.h"
#include "protocols/common/query_plan.h"
#include "protocols/modbus/settings.h"
#include "protocols/modbus/values.h"

namespace baudgate::protocols::modbus {

std::optional<Table> TableOf(std::uint8_t function);

/// Returns the PDU that reads the block, such as "03 00 C8 00 02". For an identification: from the
/// object `block.begin` on.
Bytes ReadOf(const Block<Space>& block);
/// Returns the block that a request reads. Empty: the request is not a read, or is incomplete.
std::optional<Block<Space>> BlockOf(View request);
inline Block<Space> BlockOf(const Location& place) {
  return {place.space(), BeginOf(place), EndOf(place), 1};
}
/// Returns the name of a location in the words of `read`: "holding 200", "file 4:1",
/// "identification 0".
std::string LabelOf(const Space& space, std::size_t address);

struct Data {
  Space space;
  std::size_t address = 0;
  /// The registers; for bits 0 or 1 each; for a server id its bytes, one in each word.
  Registers words;
  /// True: the reply contains all that the device has, even if more was requested. Examples: a
  /// queue with few entries, a server id.
  bool whole = false;
  /// For an identification: the text of each object by its number. For a server id: its text at key
  /// 0.
  std::map<std::size_t, std::string> texts{};
  /// The next object, if the identification continues in another reply.
  std::optional<std::uint8_t> follows{};

  Block<Space> block() const { return {space, address, address + words.size(), 1}; }
};

/// Returns the data of a good reply; empty if `request` is not a read. `reply` must have passed
/// CheckReply for `request`.
std::optional<Data> DataOf(View request, View reply);

using SpacePlan = QueryPlan<Space>;

/// Returns the location of each point, by index; an entry is empty if the point is not read.
std::vector<std::optional<Location>> ReadLocations(std::span<const config::Point> points);

/// Plans the requests for `points`. `places`: the result of ReadLocations for `points`. If the
/// device refuses points that it has never answered, they are read with the slow group.
SpacePlan MakePlan(std::span<const config::Point> points,
                   std::span<const std::optional<Location>> places, const Settings& settings,
                   Often is_often = IsFast);

/// Returns reads that can serve as probes, because the reply to each differs in length from the
/// replies to all polls of its table. Each read begins where a poll begins. Reads within the range
/// of that poll come first, because a device may refuse registers behind it.
std::vector<Block<Space>> DistinctReads(const SpacePlan& plan);

}  // namespace baudgate::protocols::modbus
