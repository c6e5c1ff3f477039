// Several digital outputs of one module in one exchange: `#AA00DD` sets all eight of a group. What
// the others are comes from the module's own digital word, read just before; points say which bit
// shows which output. Points come from the configuration, commands go to conversation.h. Source:
// dcon reference, 8.2.
//
//   relay_1: read "$6[b1]", write "#11{bit}"      output 1 of the low group is bit 1 of $6
//   on relay_1, off relay_3:   > $016  < !000900      8 | 1: relays 3 and 0 are on
//                              > #010003              all eight: 0 and 1 on
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "protocols/conversation.h"
#include "protocols/dcon/points.h"
#include "protocols/dcon/settings.h"

namespace baudgate::protocols::dcon {

struct OutputGroup {
  std::string command;  ///< "#00": sets all of it
  std::string read;     ///< "$6": shows it
  unsigned base = 0;    ///< the bit of its first output there

  bool operator==(const OutputGroup&) const = default;
};

struct GroupedOutput {
  OutputGroup group;
  unsigned number = 0;  ///< in the group, 0…7
};

/// Empty: it is written alone.
std::optional<GroupedOutput> GroupOf(const std::optional<ReadAddress>& read,
                                     const std::optional<WriteAddress>& write,
                                     const Settings& settings);

using GroupedOutputs = std::vector<std::optional<GroupedOutput>>;  ///< by point

/// How many of these, from the first on, are different outputs of one group.
std::size_t Together(const GroupedOutputs& outputs, std::span<const PointValue> writes);

/// All outputs of the group, as they are in `word` but for those that the task writes.
std::uint8_t AllOutputs(const GroupedOutputs& outputs, const Task& task, std::uint64_t word);

/// As they are.
std::uint8_t OutputsIn(const OutputGroup& group, std::uint64_t word);

}  // namespace baudgate::protocols::dcon
