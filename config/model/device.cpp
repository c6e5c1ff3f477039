// SPDX-License-Identifier: Apache-2.0
#include "config/model/device.h"

namespace baudgate::config {

std::string SpokenName(std::string_view name) {
  std::string spoken;
  for (const char c : name) {
    if (c > ' ') spoken += c >= 'a' && c <= 'z' ? static_cast<char>(c - 'a' + 'A') : c;
  }
  return spoken;
}

std::string_view Name(WordOrder order) {
  constexpr std::array<std::string_view, 5> kNames = {"ABCD", "CDAB", "BADC", "DCBA", "CDABGHEF"};
  return kNames[static_cast<std::size_t>(order)];
}

Duration PeriodOf(const Device& device, Group group) {
  switch (group) {
    case Group::once:
      return {};
    case Group::daily:
      return device.daily;
    case Group::slow:
      return device.slow;
    case Group::fast:
      return device.poll;
    case Group::again:
      return kAgainPeriod;
    default:
      break;
  }
  const std::size_t interval = static_cast<std::size_t>(group) - kNamedGroups;
  return interval < device.intervals.size() ? device.intervals[interval] : device.poll;
}

bool IsOften(const Device& device, Group group) {
  const Duration period = PeriodOf(device, group);
  return period > Duration::zero() && period <= kAgainPeriod;
}

std::optional<Duration> MaxAgeOf(const Device& device, Group group) {
  if (group == Group::once) return std::nullopt;
  const Duration usual = 3 * PeriodOf(device, group);
  if (group == Group::daily) return usual;
  if (device.never_old && !device.max_age) return std::nullopt;
  return device.max_age.value_or(usual);
}

}  // namespace baudgate::config
