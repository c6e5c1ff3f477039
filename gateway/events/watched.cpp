// SPDX-License-Identifier: Apache-2.0
#include "gateway/events/watched.h"

#include <algorithm>
#include <string>

#include "gateway/events/point_watch.h"

namespace baudgate::events {
namespace {

bool Watches(const config::Device& device, const Alarm& alarm) {
  const auto raises = [&](const config::EventText& text) {
    return text.alarm != config::AlarmPriority::none &&
           alarm.name.ends_with(":" + std::to_string(text.code));
  };
  if (alarm.point.empty()) {
    return device.events && std::ranges::any_of(device.event_texts, raises);
  }
  return device.point_events && std::ranges::any_of(device.points, [&](const auto& point) {
           return point.name == alarm.point &&
                  std::ranges::any_of(point.events, [&](const config::PointEvent& event) {
                    return event.alarm != config::AlarmPriority::none &&
                           SubjectOf(point, event) == alarm.name;
                  });
         });
}

}  // namespace

bool Watches(const config::Config& config, const Alarm& alarm) {
  for (const config::Line& line : config.lines) {
    if (line.name != alarm.line) continue;
    for (const config::Device& device : line.devices) {
      if (device.name == alarm.device) return Watches(device, alarm);
    }
  }
  return false;
}

}  // namespace baudgate::events
