// SPDX-License-Identifier: Apache-2.0
#include "protocols/dcon/places.h"

#include <algorithm>

#include "gateway/base/text.h"

namespace baudgate::protocols::dcon {
namespace {

constexpr const char* kReadAll = "#";
// Number of unanswered probes after which one probe is sent in the other checksum mode.
constexpr std::size_t kProbesOfOwnMode = 3;

/// Estimates the length of a reply in characters; the cheapest read serves as a probe.
std::size_t Cost(Form form, std::size_t points) {
  if (form == Form::numbers) return 2 + 7 * points;
  return form == Form::words ? 2 + 4 * points : 10;
}

/// Returns a probe that no poll sends: the module's name (`$AAM`), or one channel if polls read all
/// channels together. Empty: no such request exists.
std::string OwnProbe(const Settings& settings, const Probing::Reads& reads, bool polls,
                     std::size_t channels) {
  if (settings.identify || !polls) return kAskName;
  // If a poll reads a single channel, its late reply could be taken for the reply to such a probe.
  bool all_together = false;
  for (const auto& read : reads) {
    if (!read || read->command[0] != '#') continue;
    if (read->command != kReadAll) return {};
    all_together = true;
  }
  if (!all_together || channels < 2) return {};
  std::size_t first = channels;
  for (const auto& read : reads) {
    if (read && read->command == kReadAll) first = std::min<std::size_t>(first, read->index);
  }
  constexpr std::string_view kDigits = "0123456789ABCDEF";
  return first < kDigits.size() ? kReadAll + std::string(1, kDigits[first]) : std::string();
}

ProbeChoice::Own KindOf(std::string_view own) {
  if (own.empty()) return ProbeChoice::Own::none;
  return own == kAskName ? ProbeChoice::Own::identification : ProbeChoice::Own::read;
}

}  // namespace

Probing::Probing(const Settings& settings, const Reads& reads, const QueryPlan<Read>& plan,
                 std::size_t channels)
    : settings_(settings),
      plan_(plan),
      own_(OwnProbe(settings, reads, !plan.queries().empty(), channels)),
      choice_(KindOf(own_)) {}

bool Probing::IsInOtherMode() const {
  return settings_.identify && unanswered_ % (kProbesOfOwnMode + 1) == kProbesOfOwnMode;
}

/// Returns the command of the next probe. Among the reads of the polls it prefers the shortest that
/// was answered before. If none was answered, it takes the first read, because profiles begin with
/// a read that always works.
std::string Probing::Command(const Identification& identification) const {
  std::vector<std::string> reads;
  std::size_t best = 0;
  std::size_t best_cost = 0;
  for (std::size_t query = 0; query < plan_.queries().size(); ++query) {
    const Read& read = plan_.block(query).key;
    const bool allowed =
        Identification::IsHarmless(read.command) || identification.Allows(read.command);
    if (!IsRepeatable(read.command) || !allowed) continue;
    reads.push_back(read.command);
    const std::size_t cost = Cost(read.form, plan_.queries()[query].points.size());
    if (!plan_.IsProven(query) || (best_cost != 0 && cost >= best_cost)) continue;
    best = reads.size() - 1;
    best_cost = cost;
  }
  const auto read = choice_.Next(reads.size(), best);
  if (read) return reads[*read];
  return own_.empty() ? kAskName : own_;
}

void Probing::OnAnswered(std::string_view command) {
  unanswered_ = 0;
  choice_.OnAnswered(IsOwn(command));
}

void Probing::OnPolled() {
  unanswered_ = 0;
  choice_.OnPolled();
}

bool Probing::OnFailed(bool own, bool silent) {
  unanswered_ = silent ? unanswered_ + 1 : 0;
  return choice_.OnFailed(own && silent);
}

namespace {

constexpr unsigned kOutputs = 8;  // outputs in a group
constexpr unsigned kBits = 16;    // bits in a digital word

/// Returns the command that sets all outputs of a group: "#00" for outputs that are written with
/// "#13", "#0A" for "#A3", "#0B" for "#B3".
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

namespace {

constexpr int kRefusals = 3;

}  // namespace

Places::Places(const config::Device& device, const Settings& options) {
  for (const config::Point& point : device.points) {
    // check_point has reported addresses that cannot be parsed.
    const auto write = ParseWrite(point.write);
    const bool written = point.access != config::Access::read && write;
    writes.push_back(written ? std::optional(*write) : std::nullopt);
    if (written && write->setting) settings.push_back(*write);
    const auto read = ParseRead(point.read);
    const bool polled = point.access != config::Access::write && read;
    if (polled) by_command[read->command].push_back(reads.size());
    reads.push_back(polled ? std::optional(*read) : std::nullopt);
    outputs.push_back(GroupOf(reads.back(), writes.back(), options));
  }
}

std::span<const std::size_t> Places::ReadBy(std::string_view command) const {
  const auto its = by_command.find(command);
  return its == by_command.end() ? std::span<const std::size_t>() : its->second;
}

std::size_t Places::ChannelsOf(std::string_view command, const Settings& settings) const {
  if (settings.channels != 0) return settings.channels;
  std::size_t count = 0;
  for (const std::size_t point : ReadBy(command)) {
    const ReadAddress& read = *reads[point];
    if (read.select == ReadAddress::Select::index) {
      count = std::max<std::size_t>(count, read.index + 1);
    }
  }
  return count;
}

std::optional<Form> Places::FormOf(std::string_view command) const {
  const auto points = ReadBy(command);
  return points.empty() ? std::nullopt : std::optional(reads[points.front()]->form);
}

bool Places::IsSetting(std::string_view command) const {
  return std::ranges::any_of(settings, [command](const WriteAddress& write) {
    return ParseWritten(write, command).has_value();
  });
}

QueryPlan<Read> MakePlan(const config::Device& device, const Places& places) {
  QueryPlan<Read> plan({.may_join = {}, .refusals = kRefusals, .is_often = OftenOf(device)});
  for (std::size_t i = 0; i < places.reads.size(); ++i) {
    const auto& read = places.reads[i];
    if (read) plan.Add(device.points[i].group, i, {read->command, read->form});
  }
  plan.Make();
  return plan;
}

}  // namespace baudgate::protocols::dcon
