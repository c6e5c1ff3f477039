// What a slave holds and which function reads it: tables of registers and bits, files, queues,
// counters of the line, and what it says of itself. Places come from points.h, requests go to
// planning, replies to values. Source: MODBUS Application Protocol V1.1b3, 6.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <string_view>

#include "gateway/base/bytes.h"
#include "protocols/common/query_plan.h"
#include "protocols/modbus/values.h"

namespace baudgate::protocols::modbus {

/// The function that reads the table.
std::uint8_t ReadFunction(Table table);
/// The table that a reading function reads.
std::optional<Table> TableOf(std::uint8_t function);

/// The PDU that reads the block: 03 00 C8 00 02. Of an identification: from object `block.begin`.
Bytes ReadOf(const Block<Space>& block);
/// What a request reads; empty: it reads none of this.
std::optional<Block<Space>> BlockOf(View request);
inline Block<Space> BlockOf(const Place& place) {
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

}  // namespace baudgate::protocols::modbus
