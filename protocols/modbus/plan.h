// Which requests read a device's points: neighbours of one table share one, with the registers
// between them, as far as the device lets them. Points come from the configuration. ReadFunction
// and TableOf say which function reads what.
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

// What a slave holds and which function reads it: tables of registers and bits, files, queues,
// counters of the line, and what it says of itself. Places come from points.h, requests go to
// planning, replies to values. Source: MODBUS Application Protocol V1.1b3, 6.

/// The table that a reading function reads.
std::optional<Table> TableOf(std::uint8_t function);

/// The PDU that reads the block: 03 00 C8 00 02. Of an identification: from object `block.begin`.
Bytes ReadOf(const Block<Space>& block);
/// What a request reads; empty: it reads none of this.
std::optional<Block<Space>> BlockOf(View request);
inline Block<Space> BlockOf(const Location& place) {
  return {place.space(), BeginOf(place), EndOf(place), 1};
}
/// "holding 200", "file 4:1", "identification 0": the place in the words of `read`.
std::string LabelOf(const Space& space, std::size_t address);

/// What a good reply to a read holds.
struct Data {
  Space space;
  std::size_t address = 0;
  Registers words;  ///< registers; bits as 0 and 1; of a server id its bytes
  /// It holds all that there is, however much was asked for: a queue with two entries, a server id.
  bool whole = false;
  std::map<std::size_t, std::string> texts{};  ///< of an identification by object; of a server id 0
  std::optional<std::uint8_t> follows{};       ///< of an identification: the object to go on with

  Block<Space> block() const { return {space, address, address + words.size(), 1}; }
};

/// `reply`: one that fits its request, as CheckReply has said.
std::optional<Data> DataOf(View request, View reply);

using SpacePlan = QueryPlan<Space>;

/// Where each point is read; nothing where it is not.
std::vector<std::optional<Location>> ReadLocations(std::span<const config::Point> points);

/// `places`: those of `points`. What a device refuses and has never answered is asked with the slow
/// group.
SpacePlan MakePlan(std::span<const config::Point> points,
                   std::span<const std::optional<Location>> places, const Settings& settings,
                   Often is_often = IsFast);

/// Reads of as many registers, or bytes of bits, as no query of the same table asks for, each from
/// where a query begins. First those that ask for nothing beyond their query: a device may refuse
/// the others. Empty: there is no query of a table.
std::vector<Block<Space>> DistinctReads(const SpacePlan& plan);

}  // namespace baudgate::protocols::modbus
