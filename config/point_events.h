// The key `events:` of a point: { on: above, value: 5, delay: 3s, alarm: high }, or a list of
// these.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "config/model/point.h"
#include "config/yaml/yaml_reader.h"

namespace baudgate::config {

/// Longer texts leave no room for the point and its value.
inline constexpr std::size_t kLongestEventText = 100;

/// With every problem that they have; `point` is read but for them.
std::vector<PointEvent> ReadPointEvents(MapReader& map, const Point& point);

/// `alarm: yes`, or a priority. Also of a table of events.
AlarmPriority ReadAlarm(MapReader& map);

/// `text`, and a problem where it is too long. Also of a table of events.
std::string ReadEventText(MapReader& map);

/// `record: trip`. Also of a table of events.
std::string ReadRecordName(MapReader& map);

}  // namespace baudgate::config
