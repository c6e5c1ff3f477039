// The alarms that the gateway raises itself: the key `alarms:` of the gateway, a line, a device and
// a route. The more specific setting wins, each key by itself.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>

#include "config/model/fields.h"
#include "config/model/point_event.h"
#include "gateway/base/time.h"

namespace baudgate::config {

struct AlarmSetting {
  AlarmPriority priority = AlarmPriority::medium;  ///< none: `off`
  /// A trouble raises its alarm once it has lasted this long.
  Duration delay = std::chrono::seconds(30);

  bool on() const { return priority != AlarmPriority::none; }
  bool operator==(const AlarmSetting&) const = default;
};

template <typename Visit>
void VisitFields(const AlarmSetting*, Visit visit) {
  visit(Field<&AlarmSetting::priority>());
  visit(Field<&AlarmSetting::delay>());
}

}  // namespace baudgate::config
