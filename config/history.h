// The key history: which values are kept.
//
//   history:
//     points:
//       - "bay-1.*.current_*"                       LINE.DEVICE.POINT, each with * and ?
//       - { match: "io.ai-1.*", deadband: 0.5 }     of several that match the first counts
//       - { match: "*.*.serial", log: off }         changes, if it is not said; all; off
//     max_gap: 10min                                also at one of the points
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

// The key records: of a profile: points that are read together behind an event, and kept with it.
//
//   records:
//     trip: { points: [ trip_phases, "record?_*" ] }
//   events:
//     - { code: 3, state: on, text: "stage I> tripped", record: trip }

std::vector<RecordPattern> ReadRecords(const YamlNode& node, Problems& problems);

/// A problem where there is no such record; an empty name is none.
void CheckRecordName(const std::string& name, const Mark& mark,
                     const std::vector<RecordPattern>& records, Problems& problems);

/// `device` has its points and knows whether it is asked for events. Its records that an event
/// names; where they are kept their slow points become daily ones: they are read after the event.
void ResolveRecords(const std::vector<RecordPattern>& records, Device& device, Problems& problems);

/// After the lines, whose points it names.
History ReadHistory(const YamlNode& node, const Config& config, Problems& problems);

}  // namespace baudgate::config
