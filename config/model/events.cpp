// SPDX-License-Identifier: Apache-2.0
#include "config/model/events.h"

#include <array>

#include "gateway/base/text.h"

namespace baudgate::config {

std::string_view Name(AlarmPriority priority) {
  constexpr std::array<std::string_view, kAlarmPriorities> kNames = {"", "low", "medium", "high"};
  return kNames[static_cast<std::size_t>(priority)];
}

std::string ConditionOf(const PointEvent& event) {
  std::string text(Name(event.on));
  if (event.on != PointEvent::On::change) text += " " + event.value.ToText();
  return text;
}

const EventText* FindEvent(std::span<const EventText> table, std::uint32_t channel,
                           std::uint32_t code) {
  const EventText* found = nullptr;
  for (const EventText& one : table) {
    if (one.code != code || (one.channel && *one.channel != channel)) continue;
    if (found == nullptr || one.channel) found = &one;
  }
  return found;
}

const EventText* FindEndedAlarm(std::span<const EventText> table, std::uint32_t channel,
                                std::uint32_t code) {
  for (const EventText& one : table) {
    if (one.until != code || (one.channel && *one.channel != channel)) continue;
    if (FindEvent(table, channel, one.code) == &one) return &one;
  }
  return nullptr;
}

}  // namespace baudgate::config
