// `Device` is a device of a line as configured, `Profile` a device type.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <chrono>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "config/model/events.h"
#include "config/model/fields.h"
#include "config/model/modbus.h"
#include "config/model/options.h"
#include "config/model/point.h"
#include "config/model/problem.h"
#include "config/model/serial.h"
#include "config/model/timing.h"
#include "gateway/base/time.h"

namespace baudgate::config {

enum class OnBad : std::uint8_t { exception, hold, nan };
/// The order of the bytes of a 32-bit value 0xAABBCCDD in two registers; 64-bit values likewise.
enum class WordOrder : std::uint8_t {
  abcd,
  cdab,
  badc,
  dcba,
  cdabghef,  ///< for four registers: the words of each half exchanged; allowed at devices only
};
template <>
inline constexpr std::array<Word<WordOrder>, 4> kWords<WordOrder> = {{{"ABCD", WordOrder::abcd},
                                                                      {"CDAB", WordOrder::cdab},
                                                                      {"BADC", WordOrder::badc},
                                                                      {"DCBA", WordOrder::dcba}}};

/// The names that a device may report, compared without spaces and case (SpokenName).
struct Identity {
  std::vector<std::string> names;  ///< names of this device type; empty: unknown
  /// Names of other device types, each with the profile that lists it.
  std::map<std::string, std::string> others;
  bool ignore = false;
};

template <typename Visit>
void VisitFields(const Identity*, Visit visit) {
  visit(Field<&Identity::names>());
  visit(Field<&Identity::others>());
  visit(Field<&Identity::ignore>{"identity"});
}

/// Returns the form in which names are compared: " spaj 140c" gives "SPAJ140C".
std::string SpokenName(std::string_view name);

/// A named set of points that are read after an event and saved together with it.
struct Record {
  std::string name;
  std::vector<std::uint32_t> points;
};

template <typename Visit>
void VisitFields(const Record*, Visit visit) {
  visit(Field<&Record::name>());
  visit(Field<&Record::points>());
}

struct Device {
  std::string name;
  std::string address;   ///< as written; the protocol parses it
  std::string protocol;  ///< the protocol of the line, or the device's own protocol
  std::string profile;   ///< empty if all points are in the device's `points`
  std::string title;     ///< text of the profile's key `device`, which describes the type
  std::optional<std::uint8_t> unit;
  bool enabled = true;
  /// For a device whose replies never show which request they answer
  /// (gateway/bus/replies/whose_reply.h). True: when the line was silent longer than any reply can
  /// be late, the device's replies count as being in the order of the requests.
  bool trust_order = false;
  /// The default for the device's points, and the setting for its events.
  Recheck recheck = Recheck::off;
  Duration poll = std::chrono::seconds(1);
  Duration slow = std::chrono::minutes(1);
  Duration daily = std::chrono::hours(24);
  std::vector<Duration> intervals;  ///< periods of points that have their own `poll`
  std::optional<Duration> max_age;  ///< empty: see MaxAgeOf
  /// Empty: 3 x max_age, or the time of 6 rounds of fast polls over the line, if longer.
  std::optional<Duration> dead_age;
  bool never_old = false;             ///< the device sends unasked, and its silence is normal
  const Traits* traits = &kNoTraits;  ///< traits of its protocol; valid while the program runs
  OnBad on_bad = OnBad::exception;
  WordOrder word_order = WordOrder::abcd;
  /// From the device or its profile; empty: the retries of the line apply.
  std::optional<int> retries;
  /// The times that the device or its profile sets, and longer times of the line (MergeDevice).
  /// Other times of line and protocol are added later.
  Timing timing;
  std::optional<SerialSettings> serial;  ///< set if the line's settings are changed for this device
  Identity identity;
  Options options;
  std::vector<Point> points;  ///< points of the profile and of the device, merged
  bool events = false;        ///< events of the device are requested and recorded
  bool point_events = false;  ///< events of its points are recorded
  AlarmSetting alarms;  ///< for alarms of the device itself; takes precedence over line and gateway
  std::vector<EventText> event_texts;
  std::vector<Record> records;
  Mark mark;
};

template <typename Visit>
void VisitFields(const Device*, Visit visit) {
  visit(Field<&Device::name>{.help = "letters, digits, single - or _", .fallback = kRequired});
  visit(Field<&Device::address>{.help = "address in the protocol's own form; SPA: 1…899",
                                .fallback = "required, unless the protocol has none"});
  visit(Field<&Device::protocol>{.help = "needed on a line with devices of several protocols",
                                 .fallback = "the line's"});
  visit(Field<&Device::profile>{.help = "a name from `baudgate profiles`, or a path relative to "
                                        "the file; without a profile, points lists all points"});
  visit(Field<&Device::title>());
  visit(Field<&Device::unit>{"unit", "Modbus unit id; without it the device is not on Modbus", 1,
                             kLastSlave});
  visit(Field<&Device::enabled>{.help = "false: the device is not polled"});
  visit(Field<&Device::trust_order>{
      .help = "true: nothing between gateway and device can delay replies (docs/timeouts.md)"});
  visit(Field<&Device::recheck>());
  visit(Field<&Device::poll>());
  visit(Field<&Device::slow>());
  visit(Field<&Device::daily>());
  visit(Derived<&Device::intervals>());
  visit(Field<&Device::max_age>{"max_age", "values older than this are uncertain; at least poll",
                                10ms, 30 * 24h, "3 × the point's period"});
  visit(Field<&Device::dead_age>{"dead_age", "values older than this are bad; at least max_age",
                                 10ms, 90 * 24h, "3 × max_age"});
  visit(Derived<&Device::never_old>());
  visit(Derived<&Device::traits>());
  visit(Field<&Device::on_bad>{.help = "what Modbus clients get while the device is lost"});
  visit(Field<&Device::word_order>{.help = "byte order of 32-bit values in two registers"});
  visit(Field<&Device::retries>());
  visit(Field<&Device::timing>());
  visit(Field<&Device::serial>{.help = "serial settings, if they differ for this device",
                               .fallback = "the line's"});
  visit(Field<&Device::identity>{.help = "names that the device may send; if it sends a name of "
                                         "another profile, its values are bad; ignore: no check",
                                 .fallback = "the profile's"});
  visit(Field<&Device::options>());
  visit(Field<&Device::points>{.help = "a list of points, below; their keys replace those of the "
                                       "profile's point with the same name"});
  visit(Field<&Device::events>{.help = "events of the device and of its points are stored",
                               .fallback = "true with the key events at the top level"});
  visit(Field<&Device::point_events>());
  visit(Field<&Device::alarms>{.help = "a priority, or a map, below", .fallback = "the line's"});
  visit(Key{"event_alarms",
            "priorities of rows of the profile's table of events: { \"2E17\": high }",
            "high, medium, low, off"});
  visit(
      Key{"ratios", "what one unit is worth at this device: with { xIn: 400 A } one xIn is 400 A"});
  visit(
      Key{"write",
          "which points may be written; a Modbus client also needs a listener that permits writes",
          "deny, allow, [points]", "deny"});
  visit(Key{"allow_when", "interlocks of all points of the device, below"});
  visit(Field<&Device::event_texts>());
  visit(Field<&Device::records>());
  visit(Derived<&Device::mark>());
}

/// Returns the period of the group; zero if the group is read only once.
Duration PeriodOf(const Device& device, Group group);
/// True if the group is read at least every kAgainPeriod.
bool IsOften(const Device& device, Group group);
/// Returns the age from which values of the group are uncertain; nothing if they never are.
///
///   fast, slow, points with a `poll`    max_age; default 3 periods, or never (never_old)
///   daily                               3 periods; max_age is for values that are read frequently
///   once                                never
std::optional<Duration> MaxAgeOf(const Device& device, Group group);

/// A record of a profile, whose points are given as patterns. Example:
/// `records: { trip: { points: [ trip_phases, "record?_*" ] } }`.
struct RecordPattern {
  std::string name;
  std::vector<std::string> points;  ///< names, with * for any text and ? for any character
  Mark mark;
};

/// A device type: title, options and points of config/profiles/<protocol>/<name>.yaml.
struct Profile {
  std::string name;
  std::string protocol;
  std::string title;
  Pace pace;
  std::optional<WordOrder> word_order;
  std::vector<std::string> identity;  ///< names that devices of this type report
  Options options;                    ///< only the options that the profile sets
  std::vector<Point> points;
  std::vector<EventText> event_texts;  ///< empty: the device type has no events, or none is known
  std::vector<RecordPattern> records;
};

template <typename Visit>
void VisitFields(const Profile*, Visit visit) {
  visit(Derived<&Profile::name>());
  visit(Derived<&Profile::protocol>());
  visit(Field<&Profile::title>{
      .key = "device", .help = "description of the device type", .fallback = kRequired});
  visit(Field<&Profile::pace>());
  visit(Field<&Profile::word_order>{.help = "as at a device"});
  visit(Field<&Profile::identity>{.help = "names that devices of this type send"});
  visit(Field<&Profile::options>());
  visit(Field<&Profile::points>{.help = "a list of points, above", .fallback = kRequired});
  visit(Field<&Profile::records>{
      .help = "points that are read after an event: { trip: { points: [\"record?_*\"] } }"});
  visit(Field<&Profile::event_texts>{.key = "events", .help = "a list, below"});
}

std::string_view Name(WordOrder order);

}  // namespace baudgate::config
