// SPDX-License-Identifier: Apache-2.0
#include "protocols/dcon/output_group.h"

#include <algorithm>

#include "gateway/base/text.h"

namespace baudgate::protocols::dcon {
namespace {

constexpr unsigned kOutputs = 8;  // of a group
constexpr unsigned kBits = 16;    // of a digital word

/// "#13" writes an output of the group "#00", "#A3" of "#0A", "#B3" of "#0B".
std::string CommandOfAll(char group) { return group == '1' ? "#00" : std::string("#0") + group; }

}  // namespace

std::optional<GroupedOutput> GroupOf(const std::optional<ReadAddress>& read,
                                     const std::optional<WriteAddress>& write,
                                     const Settings& settings) {
  if (!read || !write || write->kind != WriteAddress::Kind::bit || write->command.size() != 3) {
    return std::nullopt;
  }
  const char group = write->command[1];
  const auto number = ParseInteger<unsigned>(std::string_view(write->command).substr(2));
  const bool digital = read->form == Form::bits || read->form == Form::status;
  const bool known = group == '1' || group == 'A' || group == 'B';
  const bool bit = read->select == ReadAddress::Select::bit;
  if (!number || *number >= kOutputs || !digital || !known || !bit || read->index < *number) {
    return std::nullopt;
  }
  const unsigned base = read->index - *number;
  const bool inverted = (settings.invert >> base & 0xFFU) != 0;
  if (base + kOutputs > kBits || inverted) return std::nullopt;
  return GroupedOutput{{CommandOfAll(group), read->command, base}, *number};
}

std::size_t Together(const GroupedOutputs& outputs, std::span<const PointValue> writes) {
  if (writes.empty() || !outputs[writes[0].point]) return std::min<std::size_t>(writes.size(), 1);
  const OutputGroup& group = outputs[writes[0].point]->group;
  unsigned seen = 0;
  std::size_t count = 0;
  for (const PointValue& write : writes) {
    const auto& output = outputs[write.point];
    if (!output || output->group != group || (seen >> output->number & 1U) != 0) break;
    seen |= 1U << output->number;
    ++count;
  }
  return count;
}

std::uint8_t OutputsIn(const OutputGroup& group, std::uint64_t word) {
  return static_cast<std::uint8_t>(word >> group.base & 0xFFU);
}

std::uint8_t AllOutputs(const GroupedOutputs& outputs, const Task& task, std::uint64_t word) {
  unsigned all = OutputsIn(outputs[task.point]->group, word);
  const auto set = [&](std::size_t point, const Value& value) {
    const unsigned bit = 1U << outputs[point]->number;
    all = ToDouble(value) != 0 ? all | bit : all & ~bit;
  };
  set(task.point, task.value);
  for (const PointValue& one : task.also) set(one.point, one.value);
  return static_cast<std::uint8_t>(all);
}

}  // namespace baudgate::protocols::dcon
