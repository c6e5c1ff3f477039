// `Config` is the whole configuration as plain structs, without YAML; every value has been checked.
// config/loader.h fills it. History defines which values are recorded, and ParseUnits parses sets
// of Modbus unit ids.
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

/// One recorded point. Every change of its quality is recorded; `every`, `deadband` and `max_gap`
/// decide which values are.
struct HistoryPoint {
  std::uint32_t device = 0;  ///< number of the device over all lines, see FirstDevice
  std::uint32_t point = 0;   ///< index into that device's points
  bool every = false;        ///< record every reading, changed or not
  Decimal deadband = 0;      ///< smaller changes are not recorded, in units of the value
  Duration max_gap = std::chrono::minutes(10);
};

template <typename Visit>
void VisitFields(const HistoryPoint*, Visit visit) {
  visit(Derived<&HistoryPoint::device>());
  visit(Derived<&HistoryPoint::point>());
  visit(Key{
      "match", "LINE.DEVICE.POINT, with * for any text and ? for any character", {}, kRequired});
  visit(Key{"log", "all: every reading", "changes, all, off", "changes"});
  visit(Field<&HistoryPoint::every>());
  visit(Field<&HistoryPoint::deadband>{
      .help = "a change up to this size is not stored; in the unit of the value",
      .fallback = "the point's"});
  visit(Field<&HistoryPoint::max_gap>{
      "max_gap", "an unchanged value is stored again after this time", 1s, 24h});
}

inline constexpr std::uint64_t kMegabyte = 1'000'000;

struct History {
  std::string directory;                   ///< empty: same as `state`
  std::uint64_t limit = 1000 * kMegabyte;  ///< maximum size of all files together, in bytes
  Duration keep = std::chrono::hours(24) * 365;
  std::vector<HistoryPoint> points;  ///< sorted by device and point; empty: nothing is recorded

  bool on() const { return !points.empty(); }
};

template <typename Visit>
void VisitFields(const History*, Visit visit) {
  visit(Field<&History::directory>{.help = "directory of the history files",
                                   .fallback = "gateway.state"});
  visit(Key{"max_gap", "default for all entries of points"});
  visit(Field<&History::limit>{.help = "largest size of all files together; 50MB to 10TB",
                               .fallback = "1GB"});
  visit(Field<&History::keep>{"keep", "days older than this are removed", 24h, 3660 * 24h});
  visit(Field<&History::points>{
      .help = "a list of patterns or maps, below; the first one that matches a point applies",
      .fallback = kRequired});
}

/// The gateway's treatment of a write whose record cannot be saved (gateway/records/audit).
enum class Audit : std::uint8_t {
  best_effort,  ///< the write is sent; its record waits in memory
  require,      ///< the write is refused
};

/// The recording of events of devices, of their points, and of the gateway
/// (gateway/records/events).
struct Events {
  /// True: the configuration has `events:`; false: only devices with `events: on` record events.
  bool given = false;
  std::string directory;  ///< folder of the databases; empty: same as `state`
};

template <typename Visit>
void VisitFields(const Events*, Visit visit) {
  visit(Field<&Events::given>{"events"});
  visit(Field<&Events::directory>{.help = "directory of the events and of the audit of writes",
                                  .fallback = "gateway.state"});
}

struct Config {
  std::string name = "baudgate";
  std::string recordings;  ///< folder for recordings; empty: not configured
  std::string state;       ///< folder for data that outlive the program; empty: not configured
  AlarmSetting alarms;     ///< for alarms of the gateway itself, such as a full disk
  Events events;
  History history;
  Audit audit = Audit::best_effort;
  std::string socket;  ///< path of the control socket; empty: not configured
  Modbus modbus;
  Dds dds;
  Mqtt mqtt;
  RemoteWrite remote_write;
  Web web;
  Users users;
  std::vector<Line> lines;
};

template <typename Visit>
void VisitFields(const Config*, Visit visit) {
  visit(Key{"gateway", "the gateway itself, and defaults for all lines"});
  visit(Field<&Config::name>{
      "gateway.name",
      "name of the gateway, also in every DDS sample; letters, digits, single - or _"});
  visit(Field<&Config::recordings>{.key = "gateway.recordings",
                                   .help = "directory of the flight recorder's files",
                                   .fallback = "below systemd's StateDirectory, else in memory"});
  visit(Field<&Config::state>{.key = "gateway.state",
                              .help = "directory of the data that a restart must not lose",
                              .fallback = "systemd's StateDirectory, else /var/lib/baudgate"});
  visit(Field<&Config::alarms>{.key = "gateway.alarms", .help = "a priority, or a map, below"});
  visit(Field<&Config::events>{.help = "a map, may be empty; with this key events are stored"});
  visit(Field<&Config::history>{.help = "which values are stored, and how long"});
  visit(Field<&Config::audit>{"gateway.audit",
                              "a write whose audit record cannot be stored: best_effort sends the "
                              "write and stores the record later, require refuses the write"});
  visit(Field<&Config::socket>{.key = "gateway.socket",
                               .help = "local socket for the commands status, read, write, trace …",
                               .fallback = "/run/baudgate/NAME.sock"});
  visit(Field<&Config::modbus>{.help = "ports for Modbus masters, and routes to slaves"});
  visit(Field<&Config::dds>{.help = "DDS, with the package baudgate-dds"});
  visit(Field<&Config::mqtt>{.help = "MQTT broker to publish to; without the key it is off"});
  visit(Field<&Config::remote_write>{
      .help = "time-series database that gets the stored values; needs history"});
  visit(Field<&Config::web>{.help = "web page, JSON and metrics; without the key they are off"});
  visit(Field<&Config::users>{.help = "users, roles and tokens for the page and the commands"});
  visit(Field<&Config::lines>{.help = "a list of lines; may be empty",
                              .fallback = "required, unless a route leads to a server"});
}

/// Returns the number of the first device of `lines[line]`; for a line without devices, the number
/// that its first device would have. Devices are numbered over all lines, in the order of the file.
inline std::uint32_t FirstDevice(const Config& config, std::size_t line) {
  std::size_t first = 0;
  for (std::size_t i = 0; i < line; ++i) first += config.lines[i].devices.size();
  return static_cast<std::uint32_t>(first);
}

/// Files of TLS, and the part of the configuration that names them.
struct TlsUse {
  std::string where;  ///< "web", "listener 0.0.0.0:802", "line bay-1", "route for 33-40"
  TlsFiles files;
  Mark mark;
  std::string kind;  ///< the word behind `baudgate certs` that makes such files: web, modbus, ports
};

/// Returns all uses of TLS, in the order of the file's sections.
std::vector<TlsUse> TlsUses(const Config& config);

/// The index is a Modbus unit id, or a slave address on a line.
using UnitSet = std::bitset<256>;

/// Parses "20" or "33-40" into the first and last unit id, 0…255.
Result<std::pair<std::uint8_t, std::uint8_t>> ParseUnits(std::string_view text);
/// Formats a set as "33-35, 37-40".
std::string UnitsText(const UnitSet& units);

UnitSet UnitsOf(const Route& route);
UnitSet DeviceUnits(const Config& config);
/// Returns the units that each route of config.modbus serves: the units that the route names,
/// without the units of devices and earlier routes.
std::vector<UnitSet> RouteUnits(const Config& config);

}  // namespace baudgate::config
