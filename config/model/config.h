// What the user configured, as plain structs: no YAML here, every value already checked.
// Filled by config/loader.h; read by everybody else, each by the file of its own subject.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "config/model/alarm_setting.h"
#include "config/model/fields.h"
#include "config/model/history.h"
#include "config/model/line.h"
#include "config/model/outputs.h"
#include "config/model/web.h"

namespace baudgate::config {

/// What becomes of a write whose record cannot be kept (gateway/records/audit).
enum class Audit : std::uint8_t {
  best_effort,  ///< it is sent; the record waits in memory
  require,      ///< it is refused
};

/// What happens is kept (gateway/records/events): in devices, to their points, and to the gateway
/// itself.
struct Events {
  bool given = false;     ///< without it only of devices that say `events: on`
  std::string directory;  ///< folder of the databases; empty = as `state`
};

template <typename Visit>
void VisitFields(const Events*, Visit visit) {
  visit(Field<&Events::given>{"events"});
  visit(Field<&Events::directory>());
}

struct Config {
  std::string name = "baudgate";  ///< gateway.name: the key of every DDS sample
  std::string recordings;         ///< folder of the flight recorder's files; empty = not given
  std::string state;              ///< folder of what outlives the program; empty = not given
  AlarmSetting alarms;            ///< of the gateway as a whole: its disks
  Events events;
  History history;
  Audit audit = Audit::best_effort;
  std::string socket;  ///< path of the local control socket; empty = not given
  Modbus modbus;
  Dds dds;
  Web web;
  std::vector<Line> lines;
};

template <typename Visit>
void VisitFields(const Config*, Visit visit) {
  visit(Field<&Config::name>{"gateway.name"});
  visit(Field<&Config::recordings>{"gateway.recordings"});
  visit(Field<&Config::state>{"gateway.state"});
  visit(Field<&Config::alarms>{"gateway.alarms"});
  visit(Field<&Config::events>());
  visit(Field<&Config::history>());
  visit(Field<&Config::audit>{"gateway.audit"});
  visit(Field<&Config::socket>{"gateway.socket"});
  visit(Field<&Config::modbus>());
  visit(Field<&Config::dds>());
  visit(Field<&Config::web>());
  visit(Field<&Config::lines>());
}

/// Devices are numbered through all lines, in the order of the file: the number of the first device
/// of `lines[line]`, or the one that it would have.
inline std::uint32_t FirstDevice(const Config& config, std::size_t line) {
  std::size_t first = 0;
  for (std::size_t i = 0; i < line; ++i) first += config.lines[i].devices.size();
  return static_cast<std::uint32_t>(first);
}

}  // namespace baudgate::config
