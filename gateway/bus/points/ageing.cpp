// SPDX-License-Identifier: Apache-2.0
#include "gateway/bus/points/ageing.h"

#include <algorithm>

namespace baudgate {
namespace {

AgeLimits LimitsOfGroup(const config::Device& device, config::Group group, Duration line_cycle) {
  const std::optional<Duration> max_age = MaxAgeOf(device, group);
  if (!max_age) return {};
  AgeLimits limits;
  limits.uncertain_after = std::max(*max_age, 2 * line_cycle);
  limits.bad_after = 3 * limits.uncertain_after;
  if (device.dead_age && group != config::Group::daily) {
    limits.bad_after = std::max(*device.dead_age, limits.uncertain_after);
  }
  return limits;
}

const AgeLimits& LimitsAt(const DeviceRecord& record, std::size_t point) {
  return record.age_limits[static_cast<std::size_t>(record.device->points[point].group)];
}

}  // namespace

std::array<AgeLimits, config::kGroups> LimitsOf(const config::Device& device, Duration line_cycle) {
  std::array<AgeLimits, config::kGroups> limits;
  for (std::size_t group = 0; group < config::kGroups; ++group) {
    limits[group] = LimitsOfGroup(device, static_cast<config::Group>(group), line_cycle);
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
  if (age > limits.bad_after) return Quality::bad_communication;
  if (age > limits.uncertain_after) return Quality::uncertain_last_usable;
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
  if (!limits.ages()) return std::nullopt;
  for (const Duration limit : {limits.uncertain_after, limits.bad_after}) {
    const Instant due = *held.read_at + limit + 1ns;
    if (due > now) return due;
  }
  return std::nullopt;
}

}  // namespace baudgate
