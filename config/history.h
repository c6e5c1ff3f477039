// Reads the key `history`: which values are recorded.
//
//   history:
//     points:
//       - "bay-1.*.current_*"                       LINE.DEVICE.POINT, each with * and ?
//       - { match: "io.ai-1.*", deadband: 0.5 }     the first entry that matches applies
//       - { match: "*.*.serial", log: off }         log: changes (default), all or off
//     max_gap: 10min                                also allowed at an entry of points
//     directory: /data/baudgate
//     limit: 1GB
//     keep: 365d
//
// ReadRecords reads the key `records` of a profile.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include "config/model/config.h"
#include "config/model/device.h"
#include "config/yaml/yaml_reader.h"

namespace baudgate::config {

// The key `records:` of a profile: points that are read after an event and saved together with it.
//
//   records:
//     trip: { points: [ trip_phases, "record?_*" ] }
//   events:
//     - { code: 3, state: on, text: "stage I> tripped", record: trip }

std::vector<RecordPattern> ReadRecords(const YamlNode& node, Problems& problems);

/// Reports a problem if `records` does not contain `name`; an empty name is allowed.
void CheckRecordName(const std::string& name, const Mark& mark,
                     const std::vector<RecordPattern>& records, Problems& problems);

/// Sets `device.records` from the profile's patterns. The points and the event settings of `device`
/// must have been read. If a recorded event uses a record, the points of the record in the group
/// slow change to daily: they are read after each event, so frequent polls are not needed.
void ResolveRecords(const std::vector<RecordPattern>& records, Device& device, Problems& problems);

/// Reads `history`. Must be called after the lines were read, because their points are matched.
History ReadHistory(const YamlNode& node, const Config& config, Problems& problems);

}  // namespace baudgate::config
