// A device of a line, and a device type.
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
/// Order of the bytes of a 32-bit value 0xAABBCCDD in two registers; 64-bit values alike.
enum class WordOrder : std::uint8_t {
  abcd,
  cdab,
  badc,
  dcba,
  cdabghef,  ///< of four registers: the words of each half exchanged; of devices only
};
template <>
inline constexpr std::array<Word<WordOrder>, 4> kWords<WordOrder> = {{{"ABCD", WordOrder::abcd},
                                                                      {"CDAB", WordOrder::cdab},
                                                                      {"BADC", WordOrder::badc},
                                                                      {"DCBA", WordOrder::dcba}}};

/// What a device may call itself, without regard to spaces and case (SpokenName).
struct Identity {
  std::vector<std::string> names;  ///< of this type; empty: not known
  std::map<std::string, std::string>
      others;           ///< names of other types → the profile that lists them
  bool ignore = false;  ///< it is served whatever it is
};

template <typename Visit>
void VisitFields(const Identity*, Visit visit) {
  visit(Field<&Identity::names>());
  visit(Field<&Identity::others>());
  visit(Field<&Identity::ignore>{"identity"});
}

/// "SPAJ 140 C" as " spaj 140c" and the like are compared: "SPAJ140C".
std::string SpokenName(std::string_view name);

/// Points that are read together behind an event, and kept with it as one.
struct Record {
  std::string name;
  std::vector<std::uint32_t> points;  ///< indices into the device's points
};

template <typename Visit>
void VisitFields(const Record*, Visit visit) {
  visit(Field<&Record::name>());
  visit(Field<&Record::points>());
}

struct Device {
  std::string name;
  std::string address;   ///< as written; the plugin reads it
  std::string protocol;  ///< the line's, unless the device names its own
  std::string profile;   ///< empty when all points stand inline
  std::string title;     ///< the profile's `device:`
  std::optional<std::uint8_t> unit;
  bool enabled = true;
  /// After so much silence that none can be owed by time, replies are taken to be in order: for a
  /// device that nothing it answers proves the order of (gateway/bus/replies/whose_reply.h).
  bool trust_order = false;
  Recheck recheck = Recheck::off;  ///< of its points, where they say nothing, and of its events
  Duration poll = std::chrono::seconds(1);
  Duration slow = std::chrono::minutes(1);
  Duration daily = std::chrono::hours(24);
  std::vector<Duration> intervals;    ///< of points with a `poll` of their own
  std::optional<Duration> max_age;    ///< empty: see MaxAgeOf
  std::optional<Duration> dead_age;   ///< empty: 3 x max_age, or 6 rounds of the line if longer
  bool never_old = false;             ///< it speaks unasked, and its silence is normal
  const Traits* traits = &kNoTraits;  ///< of its protocol; lives for ever
  OnBad on_bad = OnBad::exception;
  WordOrder word_order = WordOrder::abcd;
  std::optional<int> retries;  ///< device before profile; empty: the line's
  Timing timing;               ///< device before profile; the line's and the protocol's come below
  std::optional<SerialSettings> serial;  ///< where the bus is switched for this device
  Identity identity;
  Options options;            ///< the protocol's own
  std::vector<Point> points;  ///< profile and inline points merged
  bool events = false;        ///< what happens in it is asked for, and kept
  bool point_events = false;  ///< those of its points are kept
  AlarmSetting alarms;        ///< of the device itself; device before line and gateway
  std::vector<EventText> event_texts;
  std::vector<Record> records;
  Mark mark;
};

template <typename Visit>
void VisitFields(const Device*, Visit visit) {
  visit(Field<&Device::name>{.help = "letters, digits, single - or _", .fallback = kRequired});
  visit(Field<&Device::address>{.help = "the protocol's own: of SPA 1…899",
                                .fallback = "required, unless the protocol has none"});
  visit(Field<&Device::protocol>{.help = "on a line with devices of several protocols",
                                 .fallback = "the line's"});
  visit(Field<&Device::profile>{.help = "a name from `baudgate profiles`, or a path relative to "
                                        "the file; without it all points stand in points"});
  visit(Field<&Device::title>());
  visit(Field<&Device::unit>{"unit", "Modbus unit id; without it the device is not on Modbus", 1,
                             kLastSlave});
  visit(Field<&Device::enabled>{.help = "false: it is not asked"});
  visit(Field<&Device::trust_order>{
      .help = "true: nothing between gateway and device holds replies back (docs/timeouts.md)"});
  visit(Field<&Device::recheck>());
  visit(Field<&Device::poll>());
  visit(Field<&Device::slow>());
  visit(Field<&Device::daily>());
  visit(Derived<&Device::intervals>());
  visit(Field<&Device::max_age>{"max_age", "older values are uncertain; at least poll", 10ms,
                                30 * 24h, "3 × the point's period"});
  visit(Field<&Device::dead_age>{"dead_age", "still older values are bad; at least max_age", 10ms,
                                 90 * 24h, "3 × max_age"});
  visit(Derived<&Device::never_old>());
  visit(Derived<&Device::traits>());
  visit(Field<&Device::on_bad>{.help = "what Modbus shows while the device is lost"});
  visit(Field<&Device::word_order>{.help = "bytes of 32-bit values in two registers"});
  visit(Field<&Device::retries>());
  visit(Field<&Device::timing>());
  visit(Field<&Device::serial>{.help = "where the line is switched for this device",
                               .fallback = "the line's"});
  visit(Field<&Device::identity>{
      .help = "names that it tells; a name that only another profile lists makes its values bad; "
              "ignore: no check",
      .fallback = "the profile's"});
  visit(Field<&Device::options>());
  visit(Field<&Device::points>{
      .help = "a list of points, below; their keys replace those of the profile's point of that "
              "name"});
  visit(Field<&Device::events>{.help = "its events and those of its points are kept",
                               .fallback = "true with the key events at the top level"});
  visit(Field<&Device::point_events>());
  visit(Field<&Device::alarms>{.help = "a priority, or a map, below", .fallback = "the line's"});
  visit(Key{"event_alarms",
            "priorities of rows of the profile's table of events: { \"2E17\": high }",
            "high, medium, low, off"});
  visit(Key{"ratios", "what 1 of a unit stands for: { xIn: 400 A }"});
  visit(Key{"write", "which points may be written; writing also needs a listener that permits it",
            "deny, allow, [points]", "deny"});
  visit(Key{"allow_when", "interlocks of all its points, below"});
  visit(Field<&Device::event_texts>());
  visit(Field<&Device::records>());
  visit(Derived<&Device::mark>());
}

/// How often the group is read; zero: once.
Duration PeriodOf(const Device& device, Group group);
/// The group is read at least every kAgainPeriod.
bool IsOften(const Device& device, Group group);
/// From which age values of the group are doubted; empty: from none.
///
///   fast, slow, points with a `poll`    max_age; without it 3 periods, or none (never_old)
///   daily                               3 periods: max_age is meant for what is read all the time
///   once                                none
std::optional<Duration> MaxAgeOf(const Device& device, Group group);

/// `records: { trip: { points: [ trip_phases, "record?_*" ] } }` of a profile.
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
  std::vector<std::string> identity;  ///< what devices of this type call themselves
  Options options;                    ///< only those that the profile sets
  std::vector<Point> points;
  std::vector<EventText> event_texts;  ///< empty: it has no events, or nobody has said which
  std::vector<RecordPattern> records;
};

template <typename Visit>
void VisitFields(const Profile*, Visit visit) {
  visit(Derived<&Profile::name>());
  visit(Derived<&Profile::protocol>());
  visit(Field<&Profile::title>{.key = "device", .help = "what it is", .fallback = kRequired});
  visit(Field<&Profile::pace>());
  visit(Field<&Profile::word_order>{.help = "as of a device"});
  visit(Field<&Profile::identity>{.help = "names that devices of this type tell"});
  visit(Field<&Profile::options>());
  visit(Field<&Profile::points>{.help = "a list of points, above", .fallback = kRequired});
  visit(Field<&Profile::records>{
      .help = "points that are read behind an event: { trip: { points: [\"record?_*\"] } }"});
  visit(Field<&Profile::event_texts>{.key = "events", .help = "a list, below"});
}

std::string_view Name(WordOrder order);  ///< "ABCD"

}  // namespace baudgate::config
