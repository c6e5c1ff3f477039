// The key events: of the gateway, of a device, and the table of a profile.
//
//   events: {}                                      all devices whose profiles have a table
//   events: { directory: /data/baudgate }           and where events.db lies
//   - { name: feeder-1, …, events: on }             this one, or `off`: not this one
//   events:                                         in a profile
//     - { code: 1, text: "stage I> started", state: on }
//     - { channel: 2, code: 1, text: "…" }          of one channel; state: message if not said
//     - { code: 3, state: on, text: "…", alarm: high, until: 4 }
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "config/model/config.h"
#include "config/model/event_text.h"
#include "config/yaml/yaml_reader.h"

namespace baudgate::config {

Events ReadEvents(const YamlNode& node, Problems& problems);
/// `given`: the gateway has the key. `device` has its table and its points.
void ReadDeviceEvents(MapReader& map, bool given, Device& device);
/// `records`: of the same profile.
std::vector<EventText> ReadEventTable(const YamlNode& node,
                                      const std::vector<RecordPattern>& records,
                                      Problems& problems);

}  // namespace baudgate::config
