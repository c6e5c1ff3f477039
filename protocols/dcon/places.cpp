// SPDX-License-Identifier: Apache-2.0
#include "protocols/dcon/places.h"

#include <algorithm>

namespace baudgate::protocols::dcon {
namespace {

/// A damaged reply may look like a refusal: "does not have it" takes three.
constexpr int kRefusals = 3;

}  // namespace

Places::Places(const config::Device& device, const Settings& settings) {
  for (const config::Point& point : device.points) {
    // check_point has told the user of what cannot be parsed.
    const auto write = ParseWrite(point.write);
    const bool written = point.access != config::Access::read && write;
    writes.push_back(written ? std::optional(*write) : std::nullopt);
    const auto read = ParseRead(point.read);
    const bool polled = point.access != config::Access::write && read;
    reads.push_back(polled ? std::optional(*read) : std::nullopt);
    outputs.push_back(GroupOf(reads.back(), writes.back(), settings));
  }
}

std::size_t Places::ChannelsOf(std::string_view command, const Settings& settings) const {
  if (settings.channels != 0) return settings.channels;
  std::size_t count = 0;
  for (const auto& read : reads) {
    if (read && read->command == command && read->select == ReadAddress::Select::index) {
      count = std::max<std::size_t>(count, read->index + 1);
    }
  }
  return count;
}

std::optional<Form> Places::FormOf(std::string_view command) const {
  for (const auto& read : reads) {
    if (read && read->command == command) return read->form;
  }
  return std::nullopt;
}

bool Places::IsSetting(std::string_view command) const {
  return std::ranges::any_of(writes, [command](const auto& write) {
    return write && write->setting && ParseWritten(*write, command);
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
