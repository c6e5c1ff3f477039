// The keys alarms: and event_alarms:.
//
//   alarms: high                              of gateway, line, device and route; or `off`
//   alarms: { priority: low, delay: 5min }    each key for itself
//   event_alarms: { "2E17": high, "E3": off } of a device: rows of the table of its profile
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "config/model/alarm_setting.h"
#include "config/model/device.h"
#include "config/yaml/yaml_reader.h"

namespace baudgate::config {

/// `above`: what counts where the key is silent.
AlarmSetting ReadAlarmSetting(MapReader& map, const AlarmSetting& above);

/// `device` has its table of events, and it is known whether they are kept.
void ReadEventAlarms(MapReader& map, Device& device);

}  // namespace baudgate::config
