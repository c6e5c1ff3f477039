// The key records: of a profile: points that are read together behind an event, and kept with it.
//
//   records:
//     trip: { points: [ trip_phases, "record?_*" ] }
//   events:
//     - { code: 3, state: on, text: "stage I> tripped", record: trip }
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "config/model/device.h"
#include "config/yaml/yaml_reader.h"

namespace baudgate::config {

std::vector<RecordPattern> ReadRecords(const YamlNode& node, Problems& problems);

/// A problem where there is no such record; an empty name is none.
void CheckRecordName(const std::string& name, const Mark& mark,
                     const std::vector<RecordPattern>& records, Problems& problems);

/// `device` has its points and knows whether it is asked for events. Its records that an event
/// names; where they are kept their slow points become daily ones: they are read after the event.
void ResolveRecords(const std::vector<RecordPattern>& records, Device& device, Problems& problems);

}  // namespace baudgate::config
