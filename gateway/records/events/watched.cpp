// SPDX-License-Identifier: Apache-2.0
#include "gateway/records/events/watched.h"

#include <string_view>

#include "gateway/base/text.h"
#include "gateway/records/events/own_records.h"
#include "gateway/records/events/point_watch.h"
#include "gateway/records/events/trouble.h"

namespace baudgate::events {
namespace {

using Priority = std::optional<config::AlarmPriority>;

Priority Alarming(config::AlarmPriority priority) {
  return priority == config::AlarmPriority::none ? std::nullopt : Priority(priority);
}

/// "2:17": channel and code.
Priority OfEvent(const config::Device& device, std::string_view name) {
  const auto parts = Split(name, ':');
  if (parts.size() != 2) return std::nullopt;
  const auto channel = ParseInteger<std::uint32_t>(parts[0]);
  const auto code = ParseInteger<std::uint32_t>(parts[1]);
  if (!channel || !code) return std::nullopt;
  const auto* known = config::FindEvent(device.event_texts, *channel, *code);
  return known != nullptr ? Alarming(known->alarm) : std::nullopt;
}

Priority OfDevice(const config::Device& device, const Alarm& alarm) {
  if (alarm.point.empty()) {
    return device.events ? OfEvent(device, alarm.name) : std::nullopt;
  }
  if (!device.point_events) return std::nullopt;
  for (const config::Point& point : device.points) {
    if (point.name != alarm.point) continue;
    for (const config::PointEvent& event : point.events) {
      if (SubjectOf(point, event) == alarm.name) return Alarming(event.alarm);
    }
  }
  return std::nullopt;
}

}  // namespace

std::optional<config::AlarmPriority> PriorityOf(const config::Config& config, const Alarm& alarm) {
  if (const auto trouble = TroubleNamed(alarm.name); trouble && alarm.point.empty()) {
    const auto setting = SettingOf(config, *trouble, alarm.line, alarm.device);
    return setting && setting->on() ? Priority(setting->priority) : std::nullopt;
  }
  for (const config::Line& line : config.lines) {
    if (line.name != alarm.line) continue;
    for (const config::Device& device : line.devices) {
      if (device.name == alarm.device) return OfDevice(device, alarm);
    }
  }
  return std::nullopt;
}

void WatchedAlarms::Follow(EventBook& book, WallTime at) const {
  if (!watched_) return;
  for (const auto& [key, alarm] : book.alarms()) {
    if (!IsActive(alarm.state)) continue;
    const auto priority = watched_(alarm);
    if (!priority) {
      book.TellAlways(NotWatchedRecord(alarm, at));
    } else if (*priority != alarm.priority) {
      book.TellAlways(PriorityRecord(alarm, *priority, at));
    }
  }
}

}  // namespace baudgate::events
