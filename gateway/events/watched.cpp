// SPDX-License-Identifier: Apache-2.0
#include "gateway/events/watched.h"

#include <algorithm>
#include <string_view>

#include "gateway/base/text.h"
#include "gateway/events/point_watch.h"
#include "gateway/events/trouble.h"

namespace baudgate::events {
namespace {

/// "2:17": channel and code.
bool Raises(const config::Device& device, std::string_view name) {
  const auto parts = Split(name, ':');
  if (parts.size() != 2) return false;
  const auto channel = ParseInteger<std::uint32_t>(parts[0]);
  const auto code = ParseInteger<std::uint32_t>(parts[1]);
  if (!channel || !code) return false;
  const auto* known = config::FindEvent(device.event_texts, *channel, *code);
  return known != nullptr && known->alarm != config::AlarmPriority::none;
}

bool Watches(const config::Device& device, const Alarm& alarm) {
  if (alarm.point.empty()) return device.events && Raises(device, alarm.name);
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
  if (const auto trouble = TroubleNamed(alarm.name); trouble && alarm.point.empty()) {
    const auto setting = SettingOf(config, *trouble, alarm.line, alarm.device);
    return setting && setting->on();
  }
  for (const config::Line& line : config.lines) {
    if (line.name != alarm.line) continue;
    for (const config::Device& device : line.devices) {
      if (device.name == alarm.device) return Watches(device, alarm);
    }
  }
  return false;
}

}  // namespace baudgate::events
