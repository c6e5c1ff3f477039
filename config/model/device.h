// A device of a line, and a device type.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <chrono>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "config/model/events.h"
#include "config/model/fields.h"
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
  std::string address;               ///< as written; the plugin reads it
  std::string protocol;              ///< the line's, unless the device names its own
  std::string profile;               ///< empty when all points stand inline
  std::string title;                 ///< the profile's `device:`
  std::optional<std::uint8_t> unit;  ///< Modbus unit id 1…247; nothing = not on Modbus
  bool enabled = true;
  /// After so much silence that none can be owed by time, replies are taken to be in order: for a
  /// device that nothing it answers proves the order of (gateway/bus/replies/whose_reply.h).
  bool trust_order = false;
  Recheck recheck = Recheck::off;  ///< of its points, where they say nothing, and of its events
  Duration poll = std::chrono::seconds(1);  ///< period of the fast group
  Duration slow = std::chrono::minutes(1);  ///< period of the slow group
  Duration daily = std::chrono::hours(24);  ///< period of the daily group
  std::vector<Duration> intervals;          ///< of points with a `poll` of their own
  std::optional<Duration> max_age;          ///< empty: see MaxAgeOf
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
  visit(Field<&Device::name>());
  visit(Field<&Device::address>());
  visit(Field<&Device::protocol>());
  visit(Field<&Device::profile>());
  visit(Field<&Device::title>());
  visit(Field<&Device::unit>());
  visit(Field<&Device::enabled>());
  visit(Field<&Device::trust_order>());
  visit(Field<&Device::recheck>());
  visit(Field<&Device::poll>());
  visit(Field<&Device::slow>());
  visit(Field<&Device::daily>());
  visit(Derived<&Device::intervals>());
  visit(Field<&Device::max_age>());
  visit(Field<&Device::dead_age>());
  visit(Derived<&Device::never_old>());
  visit(Derived<&Device::traits>());
  visit(Field<&Device::on_bad>());
  visit(Field<&Device::word_order>());
  visit(Field<&Device::retries>());
  visit(Field<&Device::timing>());
  visit(Field<&Device::serial>());
  visit(Field<&Device::identity>());
  visit(Field<&Device::options>());
  visit(Field<&Device::points>());
  visit(Field<&Device::events>());
  visit(Field<&Device::point_events>());
  visit(Field<&Device::alarms>());
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

std::string_view Name(WordOrder order);  ///< "ABCD"

}  // namespace baudgate::config
