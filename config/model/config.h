// What the user configured, as plain structs: no YAML here, every value already checked.
// Filled by config/loader.h; read by everybody else, each by the file of its own subject. History
// says which values are kept, and ParseUnits reads sets of Modbus unit ids.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <bitset>
#include <chrono>
#include <cstdint>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "config/model/events.h"
#include "config/model/fields.h"
#include "config/model/line.h"
#include "config/model/outputs.h"
#include "gateway/base/decimal.h"
#include "gateway/base/result.h"
#include "gateway/base/time.h"

namespace baudgate::config {

// Which values are kept, and how long (gateway/records/history).

/// One point whose values are kept: every change of its quality, and of its value as said here.
struct HistoryPoint {
  std::uint32_t device = 0;  ///< through all lines, as FirstDevice counts
  std::uint32_t point = 0;   ///< in that device's points
  bool every = false;        ///< every reading, changed or not
  Decimal deadband = 0;      ///< smaller changes are not kept, in units of the value
  Duration max_gap = std::chrono::minutes(10);  ///< an unchanged value is kept again after this
};

template <typename Visit>
void VisitFields(const HistoryPoint*, Visit visit) {
  visit(Derived<&HistoryPoint::device>());
  visit(Derived<&HistoryPoint::point>());
  visit(Field<&HistoryPoint::every>());
  visit(Field<&HistoryPoint::deadband>());
  visit(Field<&HistoryPoint::max_gap>());
}

inline constexpr std::uint64_t kMegabyte = 1'000'000;

struct History {
  std::string directory;                   ///< folder of the files; empty = as `state`
  std::uint64_t limit = 1000 * kMegabyte;  ///< bytes of all files together
  Duration keep = std::chrono::hours(24) * 365;
  std::vector<HistoryPoint> points;  ///< by device and point; empty: nothing is kept

  bool on() const { return !points.empty(); }
};

template <typename Visit>
void VisitFields(const History*, Visit visit) {
  visit(Field<&History::directory>());
  visit(Field<&History::limit>());
  visit(Field<&History::keep>());
  visit(Field<&History::points>());
}

/// Audit decides about a write whose record cannot be kept (gateway/records/audit).
enum class Audit : std::uint8_t {
  best_effort,  ///< it is sent; the record waits in memory
  require,      ///< it is refused
};

/// Events are kept (gateway/records/events): those of devices, of their points, and of the gateway
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

// Sets of Modbus unit ids: as text, and which of them devices and routes have.

using UnitSet = std::bitset<256>;  ///< by Modbus unit id, or by address on a line

/// "20" or "33-40": the first and the last unit id, 0…255.
Result<std::pair<std::uint8_t, std::uint8_t>> ParseUnits(std::string_view text);
/// "33-35, 37-40".
std::string UnitsText(const UnitSet& units);

/// What the route names.
UnitSet UnitsOf(const Route& route);
/// Unit ids of all devices.
UnitSet DeviceUnits(const Config& config);
/// The units that each route of config.modbus serves: without those of devices and earlier routes.
std::vector<UnitSet> RouteUnits(const Config& config);

}  // namespace baudgate::config
