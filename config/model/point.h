// One point as configured: how it is read, what its value means, where it goes.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "config/model/events.h"
#include "config/model/fields.h"
#include "config/model/problem.h"
#include "config/model/timing.h"
#include "gateway/base/decimal.h"
#include "gateway/base/time.h"
#include "gateway/base/value.h"

namespace baudgate::config {

enum class Type : std::uint8_t {
  boolean,
  int8,  ///< in a register of its own, as int16
  uint8,
  int16,
  uint16,
  int32,
  uint32,
  int64,
  uint64,
  float32,
  float64,
  string
};
template <>
inline constexpr std::array<Word<Type>, 12> kWords<Type> = {{{"bool", Type::boolean},
                                                             {"int8", Type::int8},
                                                             {"uint8", Type::uint8},
                                                             {"int16", Type::int16},
                                                             {"uint16", Type::uint16},
                                                             {"int32", Type::int32},
                                                             {"uint32", Type::uint32},
                                                             {"int64", Type::int64},
                                                             {"uint64", Type::uint64},
                                                             {"float32", Type::float32},
                                                             {"float64", Type::float64},
                                                             {"string", Type::string}}};
enum class Access : std::uint8_t { read, write, read_write };
template <>
inline constexpr std::array<Word<Access>, 3> kWords<Access> = {
    {{"r", Access::read}, {"w", Access::write}, {"rw", Access::read_write}}};
/// What the number of a point means where IEC 61131-3 has a type of its own for it; each is an
/// unsigned number of 32 bits, as PLCs hold it.
enum class TimeType : std::uint8_t {
  none,
  time,         ///< TIME: milliseconds
  date,         ///< DATE: seconds since 1970, at midnight
  time_of_day,  ///< TOD: milliseconds since midnight
  date_time,    ///< DT: seconds since 1970
};
/// How often a point is read. `once` and `daily` so seldom that a failed read is not left to the
/// next period. `own` and those behind it are of points with a `poll` of their own: the first,
/// second … of the device's `intervals`. `again` is of queries alone: points that have answered and
/// are refused now, whatever their own group is.
inline constexpr std::size_t kMostIntervals = 8;
enum class Group : std::uint8_t { once, daily, slow, fast, own, again = own + kMostIntervals };
inline constexpr std::size_t kNamedGroups = 4;
template <>
inline constexpr std::array<Word<Group>, kNamedGroups> kWords<Group> = {
    {{"once", Group::once}, {"daily", Group::daily}, {"slow", Group::slow}, {"fast", Group::fast}}};
inline constexpr std::size_t kGroups = kNamedGroups + kMostIntervals;
constexpr Group OwnGroup(std::size_t interval) {
  return static_cast<Group>(static_cast<std::size_t>(Group::own) + interval);
}
inline constexpr Duration kAgainPeriod = std::chrono::seconds(8);
constexpr bool IsSeldom(Group group) { return group == Group::once || group == Group::daily; }
/// Which pair of Modbus tables a point lives in: registers (FC 3 and 4) or bits (FC 1 and 2).
enum class Table : std::uint8_t { registers, bits };
template <>
inline constexpr std::array<Word<Table>, 4> kWords<Table> = {{{"input", Table::registers},
                                                              {"holding", Table::registers},
                                                              {"discrete", Table::bits},
                                                              {"coil", Table::bits}}};

/// A raw value that the device sends in place of a measurement, and the quality it means.
struct Sentinel {
  Decimal value = 0;
  Quality quality = Quality::bad_sensor_failure;
  std::string written{};  ///< "0x8000"
  Mark mark{};
};

template <typename Visit>
void VisitFields(const Sentinel*, Visit visit) {
  visit(Field<&Sentinel::value>());
  visit(Field<&Sentinel::quality>());
  visit(Derived<&Sentinel::written>());
  visit(Derived<&Sentinel::mark>());
}

/// What a register shows while its channel has a fault (design: on_fault: nan | hold | VALUE).
struct OnFault {
  enum class Kind : std::uint8_t { automatic, nan, hold, value } kind = Kind::automatic;
  Decimal value = 0;
};

template <typename Visit>
void VisitFields(const OnFault*, Visit visit) {
  visit(Field<&OnFault::kind>());
  visit(Field<&OnFault::value>());
}

/// What a twin answers for this point: a fixed value, or a slow wave between two numbers.
struct Simulate {
  double low = 0;
  double high = 0;
  std::optional<std::string> text;
};

template <typename Visit>
void VisitFields(const Simulate*, Visit visit) {
  visit(Field<&Simulate::low>());
  visit(Field<&Simulate::high>());
  visit(Field<&Simulate::text>());
}

/// An interlock: `allow_when: { point: LINE.DEVICE.POINT, is: VALUE, for: VALUE }`. While that
/// point has another value, or none that is good, nothing is written.
struct AllowWhen {
  std::string point;         ///< as written
  Value is;                  ///< of that point's type; before ResolveInterlocks as written
  Value only{};              ///< guards writes of this value alone; empty: of every value
  std::uint32_t device = 0;  ///< through all lines, as FirstDevice counts
  std::uint32_t index = 0;   ///< in that device's points
  Mark mark{};
};

template <typename Visit>
void VisitFields(const AllowWhen*, Visit visit) {
  visit(Field<&AllowWhen::point>{.help = "LINE.DEVICE.POINT", .fallback = kRequired});
  visit(Field<&AllowWhen::is>{.help = "its value; with any other, or none that is good, nothing is "
                                      "written",
                              .fallback = kRequired});
  visit(Field<&AllowWhen::only>{
      .key = "for", .help = "guards writes of this value alone", .fallback = "every value"});
  visit(Derived<&AllowWhen::device>());
  visit(Derived<&AllowWhen::index>());
  visit(Derived<&AllowWhen::mark>());
}

/// What may be written to a point. Numbers are in units of its value; outside of them nothing is
/// sent. Of a point that can only be read `min` and `max` are what it may measure.
struct Writing {
  /// `access` has a w, and the device says `write: allow` or names the point.
  bool allowed = false;
  bool select = false;  ///< only within `select_time` after it was selected
  std::optional<Decimal> min;
  std::optional<Decimal> max;
  Shared<std::string> min_point;  ///< `min: NAME`: another point of the device has the number
  Shared<std::string> max_point;
  std::optional<Decimal> step;  ///< only multiples of it, counted from 0
  std::optional<int> decimals;  ///< digits that the device takes behind the decimal point
  Duration select_time = std::chrono::seconds(10);
  std::vector<AllowWhen> allow_when;  ///< all have to hold
};

template <typename Visit>
void VisitFields(const Writing*, Visit visit) {
  visit(Field<&Writing::allowed>{"write"});
  visit(Field<&Writing::min>{.help = "the least value, or the point of the device that has it"});
  visit(Field<&Writing::max>{.help = "the greatest value, or the point of the device that has it"});
  visit(Field<&Writing::min_point>{"min"});
  visit(Field<&Writing::max_point>{"max"});
  visit(Field<&Writing::step>{.help = "only multiples of it, counted from 0"});
  visit(Field<&Writing::decimals>{"decimals",
                                  "digits behind the decimal point that the device takes", 0, 9});
  visit(Field<&Writing::select>{.help = "true: written only after it was selected"});
  visit(Field<&Writing::select_time>{"select_time", "how long a selection counts", 1s, 10min});
  visit(Field<&Writing::allow_when>{.help = "an interlock, or a list of them, below"});
}

/// A large gateway has 100,000 of them: the small members stand side by side.
struct Point {
  std::string name;
  std::string read;   ///< the protocol's own address; checked by the plugin
  std::string write;  ///< where it differs from read, else empty
  std::string unit;   ///< of the value after scale and offset: "A", "xIn"
  Type type = Type::float32;
  TimeType time_type = TimeType::none;
  Access access = Access::read;  ///< what the device can do
  Group group = Group::fast;
  Recheck recheck = Recheck::off;
  Table table = Table::registers;
  std::optional<std::uint16_t> modbus;  ///< 0-based PDU address; nothing = not on Modbus
  std::size_t text_length = 0;          ///< of string(n), bytes
  Writing writing;
  std::optional<Duration> poll;  ///< its own period; then `group` is one of Group::own
  Decimal scale = 1;             ///< value = raw * scale + offset
  Decimal offset = 0;
  std::vector<Sentinel> sentinels;  ///< compared with the raw value
  OnFault on_fault;
  /// A reading that differs by more counts only when a second one agrees; in units of the value.
  /// Empty: the gateway judges by earlier values (gateway/bus/points/readings.h).
  std::optional<Decimal> jump;
  Decimal deadband = 0;  ///< DDS: smaller changes are not published, in units of the value
  std::vector<PointEvent> events;
  Shared<Simulate> simulate;
  Shared<std::string> description;
  Mark mark;
};

template <typename Visit>
void VisitFields(const Point*, Visit visit) {
  visit(Field<&Point::name>{.help = "letters, digits, single _, no digit first",
                            .fallback = kRequired});
  visit(Field<&Point::read>{.help = "the protocol's own address; `baudgate protocols NAME`",
                            .fallback = "required, unless access is w"});
  visit(Field<&Point::write>{.help = "where it is written, if not where it is read"});
  visit(Field<&Point::type>{.help = "string with its length: string(16); or as IEC 61131-3: INT, "
                                    "REAL, DT …",
                            .fallback = kRequired});
  visit(Field<&Point::text_length>{"length"});
  visit(Field<&Point::time_type>{"type"});
  visit(Field<&Point::unit>{.help = "of the value: at most 16 bytes"});
  visit(Field<&Point::access>{.help = "what the device can do"});
  visit(Field<&Point::writing>{"write"});
  visit(Field<&Point::group>{.help = "how often it is read"});
  visit(Field<&Point::poll>{"poll",
                            "an interval of its own, in place of group; at most eight a device",
                            kShortestPoll, 24h});
  visit(Field<&Point::modbus>{
      "modbus", "0-based address, 0…8999 or 9100…19999; without it not on Modbus", 0, 65535});
  visit(Field<&Point::table>{.help = "input and holding are the same, discrete and coil as well",
                             .fallback = "input; of bool discrete"});
  visit(Field<&Point::scale>{.help = "value = raw × scale + offset"});
  visit(Field<&Point::offset>{.help = "see scale"});
  visit(Field<&Point::sentinels>{
      .help = "raw values that mean a quality: { 999: sensor_failure, 0xFFFF: not_connected }"});
  visit(Field<&Point::on_fault>{
      .help = "what its register shows while its value is bad: nan, hold or a number"});
  visit(Field<&Point::jump>{.help = "how far a reading may be from the last one"});
  visit(Field<&Point::recheck>{.help = "as of a device", .fallback = "the device's"});
  visit(Field<&Point::deadband>{.help = "smaller changes are not published"});
  visit(Field<&Point::events>{.help = "an event, or a list of them, below"});
  visit(Field<&Point::simulate>{.help = "what a twin answers: a value, or [low, high]"});
  visit(Field<&Point::description>{.help = "for people"});
  visit(Derived<&Point::mark>());
}

/// "fast", or its own period: "250ms".
std::string PeriodText(const Point& point);

std::string_view Name(Group group);  ///< "own" of those behind it as well

/// The name of IEC 61131-3: "REAL", "UINT", "DT", "STRING[16]".
std::string IecName(const Point& point);

/// Registers that a point takes in the register tables; 1 for a bit.
std::size_t RegisterCount(const Point& point);

/// Smallest and largest value of an integer type.
struct IntegerRange {
  std::int64_t lowest = 0;
  std::uint64_t highest = 0;

  bool Contains(const Decimal& whole) const;
};

/// The numbers that the `read` of a point can give, before scale and offset.
struct RawNumbers {
  enum class Kind : std::uint8_t {
    any,     ///< decimal numbers, as a text has them
    single,  ///< float32
    real,    ///< float64
    whole,   ///< those of `range`
  } kind = Kind::any;
  IntegerRange range{};

  static RawNumbers Whole(std::int64_t lowest, std::uint64_t highest) {
    return {Kind::whole, {lowest, highest}};
  }
  /// All whole numbers of so many bits, 1 to 64.
  static RawNumbers Bits(unsigned bits, bool is_signed = false);
  /// 999.9 is a float32, by its digits.
  bool Contain(const Decimal& number) const;
};

/// bool counts as 0…1; types that are no integers have only 0.
IntegerRange RangeOf(Type type);
/// The range of its type; a time of day ends at midnight.
IntegerRange RangeOf(const Point& point);

}  // namespace baudgate::config
