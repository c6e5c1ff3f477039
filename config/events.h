// Reads the key `events:` of the gateway and of a device, and the table `events:` of a profile.
//
//   events: {}                                      all devices whose profiles have a table
//   events: { directory: /data/baudgate }           also sets the folder of events.db
//   - { name: feeder-1, …, events: on }             this device; `off`: not this device
//   events:                                         in a profile
//     - { code: 1, text: "stage I> started", state: on }
//     - { channel: 2, code: 1, text: "…" }          one channel only; default of state: message
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
//   alarms: { priority: low, delay: 5min }    a missing key keeps the setting above
//   event_alarms: { "2E17": high, "E3": off } of a device: rows of its profile's table

/// Reads the key `alarms`. `above` contains the settings of the level above, for absent keys.
AlarmSetting ReadAlarmSetting(MapReader& map, const AlarmSetting& above);

/// Must be called after `device.event_texts` and `device.events` were set.
void ReadEventAlarms(MapReader& map, Device& device);

// ReadPointEvents reads the key `events:` of a point: { on: above, value: 5, delay: 3s, alarm: high
// }, or a list of such maps. All other keys of `point` must have been read.

std::vector<PointEvent> ReadPointEvents(MapReader& map, const Point& point);

Events ReadEvents(const YamlNode& node, Problems& problems);
/// Reads `events:` of a device. `given`: the gateway has the key `events`. The event table and the
/// points of `device` must have been read.
void ReadDeviceEvents(MapReader& map, bool given, Device& device);
std::vector<EventText> ReadEventTable(const YamlNode& node,
                                      const std::vector<RecordPattern>& records,
                                      Problems& problems);

}  // namespace baudgate::config
