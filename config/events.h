// The key events: of the gateway, of a device, and the table of a profile.
//
//   events: {}                                      all devices whose profiles have a table
//   events: { directory: /data/baudgate }           and where events.db lies
//   - { name: feeder-1, …, events: on }             this one, or `off`: not this one
//   events:                                         in a profile
//     - { code: 1, text: "stage I> started", state: on }
//     - { channel: 2, code: 1, text: "…" }          of one channel; state: message if not said
//     - { code: 3, state: on, text: "…", alarm: high, until: 4 }
//
// ReadAlarmSetting reads the key `alarms:`, ReadEventAlarms the key `event_alarms:`, and
// ReadPointEvents the key `events:` of a point.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "config/model/config.h"
#include "config/model/device.h"
#include "config/model/events.h"
#include "config/model/point.h"
#include "config/yaml/yaml_reader.h"

namespace baudgate::config {

// The keys alarms: and event_alarms:.
//
//   alarms: high                              of gateway, line, device and route; or `off`
//   alarms: { priority: low, delay: 5min }    each key for itself
//   event_alarms: { "2E17": high, "E3": off } of a device: rows of the table of its profile

/// `above`: what counts where the key is silent.
AlarmSetting ReadAlarmSetting(MapReader& map, const AlarmSetting& above);

/// `device` has its table of events, and it is known whether they are kept.
void ReadEventAlarms(MapReader& map, Device& device);

// The key `events:` of a point: { on: above, value: 5, delay: 3s, alarm: high }, or a list of
// these.

/// With every problem that they have; `point` is read but for them.
std::vector<PointEvent> ReadPointEvents(MapReader& map, const Point& point);

Events ReadEvents(const YamlNode& node, Problems& problems);
/// `given`: the gateway has the key. `device` has its table and its points.
void ReadDeviceEvents(MapReader& map, bool given, Device& device);
/// `records`: of the same profile.
std::vector<EventText> ReadEventTable(const YamlNode& node,
                                      const std::vector<RecordPattern>& records,
                                      Problems& problems);

}  // namespace baudgate::config
