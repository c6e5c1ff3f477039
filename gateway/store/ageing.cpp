// SPDX-License-Identifier: Apache-2.0
#include "gateway/store/ageing.h"

#include <algorithm>

namespace baudgate {
namespace {

/// A point that is read once only does not age.
AgeLimits LimitsOfGroup(const config::Device& device, config::Group group, Duration line_cycle) {
  if (group == config::Group::once) return {};
  const Duration period = group == config::Group::fast ? device.poll : device.slow;
  AgeLimits limits;
  limits.max_age = std::max(device.max_age.value_or(3 * period), 2 * line_cycle);
  limits.dead_age = std::max(device.dead_age.value_or(3 * limits.max_age), limits.max_age);
  return limits;
}

const AgeLimits& LimitsAt(const DeviceRecord& record, std::size_t point) {
  return record.age_limits[static_cast<std::size_t>(record.device->points[point].group)];
}

}  // namespace

std::array<AgeLimits, 3> LimitsOf(const config::Device& device, Duration line_cycle) {
  std::array<AgeLimits, 3> limits;
  for (const config::Group group :
       {config::Group::once, config::Group::slow, config::Group::fast}) {
    limits[static_cast<std::size_t>(group)] = LimitsOfGroup(device, group, line_cycle);
  }
  return limits;
}

Quality AgedQuality(const DeviceRecord& record, std::size_t point, Instant now) {
  const PointRecord& held = record.points[point];
  if (!held.read_at) return Quality::bad_waiting;
  const Quality known = std::min(held.reported, held.at_best);  // worse ones are smaller
  if (IsBad(known)) return known;
  const AgeLimits& limits = LimitsAt(record, point);
  const Duration age = now - *held.read_at;
  if (age > limits.dead_age) return Quality::bad_communication;
  if (age > limits.max_age) return Quality::uncertain_last_usable;
  return known;
}

Quality QualityAt(const DeviceRecord& record, std::size_t point, Instant now) {
  return record.override_quality ? *record.override_quality : AgedQuality(record, point, now);
}

std::optional<Duration> AgeAt(const DeviceRecord& record, std::size_t point, Instant now) {
  const auto& read_at = record.points[point].read_at;
  if (!read_at) return std::nullopt;
  return now - *read_at;
}

std::optional<Instant> NextAgeing(const DeviceRecord& record, std::size_t point, Instant now) {
  if (record.override_quality) return std::nullopt;
  const PointRecord& held = record.points[point];
  if (!held.read_at || IsBad(std::min(held.reported, held.at_best))) return std::nullopt;
  const AgeLimits& limits = LimitsAt(record, point);
  for (const Duration limit : {limits.max_age, limits.dead_age}) {
    if (limit == Duration::max()) continue;
    const Instant due = *held.read_at + limit + 1ns;
    if (due > now) return due;
  }
  return std::nullopt;
}

}  // namespace baudgate
