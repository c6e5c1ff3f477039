// SPDX-License-Identifier: Apache-2.0
#include "config/model/point_event.h"

#include <array>

#include "gateway/base/text.h"

namespace baudgate::config {

std::string_view Name(AlarmPriority priority) {
  constexpr std::array<std::string_view, kAlarmPriorities> kNames = {"", "low", "medium", "high"};
  return kNames[static_cast<std::size_t>(priority)];
}

std::string_view Name(PointEvent::On on) {
  constexpr std::array<std::string_view, 3> kNames = {"change", "above", "below"};
  return kNames[static_cast<std::size_t>(on)];
}

std::string ConditionOf(const PointEvent& event) {
  std::string text(Name(event.on));
  if (event.on != PointEvent::On::change) text += " " + event.value.ToText();
  return text;
}

}  // namespace baudgate::config
