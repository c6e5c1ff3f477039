// `Point` is one point as configured: how it is read, what its value means, where it is published.
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
  int8,  ///< occupies one register, like int16
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
/// The IEC 61131-3 time type of a point's number, if it has one. PLCs store each type as an
/// unsigned 32-bit number.
enum class TimeType : std::uint8_t {
  none,
  time,         ///< TIME: milliseconds
  date,         ///< DATE: seconds since 1970, at midnight
  time_of_day,  ///< TOD: milliseconds since midnight
  date_time,    ///< DT: seconds since 1970
};
/// How often a point is read. A failed read of a point in the groups `once` and `daily` is repeated
/// before its next period. `own` and the seven values after it are for points with their own
/// `poll`: they stand for the first, second … of the device's `intervals`. `again` occurs only in
/// queries, for points that have answered before and that the device refuses now.
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
/// The pair of Modbus tables that contains a point: registers (FC 3 and 4) or bits (FC 1 and 2).
enum class Table : std::uint8_t { registers, bits };
template <>
inline constexpr std::array<Word<Table>, 4> kWords<Table> = {{{"input", Table::registers},
                                                              {"holding", Table::registers},
                                                              {"discrete", Table::bits},
                                                              {"coil", Table::bits}}};

/// A raw value that the device sends instead of a measurement, and the quality that it stands for.
struct Sentinel {
  Decimal value = 0;
  Quality quality = Quality::bad_sensor_failure;
  std::string written{};  ///< as in the file: "0x8000"
  Mark mark{};
};

template <typename Visit>
void VisitFields(const Sentinel*, Visit visit) {
  visit(Field<&Sentinel::value>());
  visit(Field<&Sentinel::quality>());
  visit(Derived<&Sentinel::written>());
  visit(Derived<&Sentinel::mark>());
}

/// The content of a Modbus register while the value of its point is bad (`on_fault: nan | hold |
/// VALUE`).
struct OnFault {
  enum class Kind : std::uint8_t { automatic, nan, hold, value } kind = Kind::automatic;
  Decimal value = 0;
};

template <typename Visit>
void VisitFields(const OnFault*, Visit visit) {
  visit(Field<&OnFault::kind>());
  visit(Field<&OnFault::value>());
}

/// The text that is shown for one value of a point: run for 3 in { 0: off, 3: run }.
struct StateText {
  std::int64_t value = 0;
  std::string text;
};

template <typename Visit>
void VisitFields(const StateText*, Visit visit) {
  visit(Field<&StateText::value>());
  visit(Field<&StateText::text>());
}

/// The value of a point of a simulated device: a fixed value, or a slow wave between two numbers.
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

/// An interlock: `allow_when: { point: LINE.DEVICE.POINT, is: VALUE, for: VALUE }`. Writes are
/// refused while the point LINE.DEVICE.POINT has another value, or no good value.
struct AllowWhen {
  std::string point;
  Value is;      ///< the required value; a text as written until ResolveInterlocks has converted it
  Value only{};  ///< if set, the interlock applies only to writes of this value
  std::uint32_t device = 0;  ///< number of the device over all lines, see FirstDevice
  std::uint32_t index = 0;   ///< index into that device's points
  Mark mark{};
};

template <typename Visit>
void VisitFields(const AllowWhen*, Visit visit) {
  visit(Field<&AllowWhen::point>{.help = "LINE.DEVICE.POINT", .fallback = kRequired});
  visit(Field<&AllowWhen::is>{.help = "value that this point must have; otherwise, or if its "
                                      "quality is not good, writes are refused",
                              .fallback = kRequired});
  visit(Field<&AllowWhen::only>{
      .key = "for", .help = "only writes of this value are guarded", .fallback = "every value"});
  visit(Derived<&AllowWhen::device>());
  visit(Derived<&AllowWhen::index>());
  visit(Derived<&AllowWhen::mark>());
}

/// The limits of writes to a point, in units of its value; a write outside the limits is not sent.
/// For a read-only point, `min` and `max` are its measuring range.
struct Writing {
  /// True if `access` contains w, and the key `write` of the device is `allow` or lists the point.
  bool allowed = false;
  bool select = false;  ///< a write needs a selection that is at most `select_time` old
  std::optional<Decimal> min;
  std::optional<Decimal> max;
  Shared<std::string> min_point;  ///< `min: NAME`: the point of the device that contains the limit
  Shared<std::string> max_point;
  std::optional<Decimal> step;  ///< only multiples of this number are allowed, counted from 0
  /// Digits after the decimal point of the raw number that the device accepts.
  std::optional<int> decimals;
  Duration select_time = std::chrono::seconds(10);
  std::vector<AllowWhen> allow_when;  ///< interlocks, which must all be fulfilled
};

template <typename Visit>
void VisitFields(const Writing*, Visit visit) {
  visit(Field<&Writing::allowed>{"write"});
  visit(Field<&Writing::min>{.help = "lowest value, or a point of the device that holds it"});
  visit(Field<&Writing::max>{.help = "highest value, or a point of the device that holds it"});
  visit(Field<&Writing::min_point>{"min"});
  visit(Field<&Writing::max_point>{"max"});
  visit(Field<&Writing::step>{.help = "values must be multiples of step"});
  visit(Field<&Writing::decimals>{
      "decimals",
      "digits after the decimal point that the device accepts; a value with more is refused", 0,
      9});
  visit(Field<&Writing::select>{.help = "true: the point must be selected before a write"});
  visit(Field<&Writing::select_time>{"select_time", "how long a selection is valid", 1s, 10min});
  visit(Field<&Writing::allow_when>{.help = "an interlock, or a list of them, below"});
}

/// A point as configured. A large gateway has 100,000 points, so small members are together, which
/// saves padding.
struct Point {
  std::string name;
  std::string read;   ///< address in the form of the protocol, which checks it
  std::string write;  ///< address of writes if it differs from `read`, else empty
  std::string unit;   ///< unit of the value after scale and offset: "A", "xIn"
  Type type = Type::float32;
  TimeType time_type = TimeType::none;
  Access access = Access::read;  ///< the kinds of access that the device supports for this point
  Group group = Group::fast;
  Recheck recheck = Recheck::off;
  Table table = Table::registers;
  /// The configuration names the second table of `table`: holding or coil.
  bool second_table = false;
  /// Digits after the decimal point of the shown value; empty: see ShownText.
  std::optional<std::uint8_t> precision;
  /// The 0-based PDU address of the point in the gateway's registers. Empty: the point is not on
  /// Modbus.
  std::optional<std::uint16_t> modbus;
  std::size_t text_length = 0;  ///< length in bytes of string(n)
  Writing writing;
  /// The point's own period; if set, `group` is Group::own or one of the seven values after it.
  std::optional<Duration> poll;
  Decimal scale = 1;  ///< value = raw * scale + offset
  Decimal offset = 0;
  std::vector<Sentinel> sentinels;  ///< compared with the raw value
  OnFault on_fault;
  /// A reading that differs from the previous reading by more than this number, in units of the
  /// value, must be confirmed by a second reading. Empty: the gateway decides from earlier values
  /// (gateway/bus/points/readings.h).
  std::optional<Decimal> jump;
  Decimal deadband = 0;  ///< DDS: smaller changes are not published; in units of the value
  std::vector<PointEvent> events;
  Shared<std::vector<StateText>> states;
  Shared<Simulate> simulate;
  Shared<std::string> description;
  Mark mark;
};

template <typename Visit>
void VisitFields(const Point*, Visit visit) {
  visit(Field<&Point::name>{.help = "letters, digits, single _, no digit first",
                            .fallback = kRequired});
  visit(Field<&Point::read>{
      .help = "address in the protocol's own form; see `baudgate protocols NAME`",
      .fallback = "required, unless access is w"});
  visit(Field<&Point::write>{.help = "address for writing, if it differs from read"});
  visit(Field<&Point::type>{.help = "string with its length: string(16); or as IEC 61131-3: INT, "
                                    "REAL, DT …",
                            .fallback = kRequired});
  visit(Field<&Point::text_length>{"length"});
  visit(Field<&Point::time_type>{"type"});
  visit(Field<&Point::unit>{.help = "unit of the value, at most 16 bytes"});
  visit(Field<&Point::access>{.help = "r: read only, w: write only, rw: both"});
  visit(Field<&Point::writing>{"write"});
  visit(Field<&Point::group>{.help = "how often the point is read"});
  visit(Field<&Point::poll>{
      "poll",
      "the point's own interval, in place of group; at most eight different ones per device",
      kShortestPoll, 24h});
  visit(Field<&Point::modbus>{
      "modbus", "0-based address, 0…8999 or 9100…19999; without it the point is not on Modbus", 0,
      65535});
  visit(Field<&Point::table>{
      .help = "input and holding show the same registers, discrete and coil the same bits",
      .fallback = "input; of bool discrete"});
  visit(Field<&Point::second_table>{"table"});
  visit(Field<&Point::scale>{.help = "value = raw × scale + offset"});
  visit(Field<&Point::offset>{.help = "value = raw × scale + offset"});
  visit(Field<&Point::precision>{"precision",
                                 "digits after the decimal point of the value that is shown", 0, 9,
                                 "four significant digits"});
  visit(Field<&Point::states>{
      .help = "texts that are shown for values of an integer or bool: { 0: off, 3: run }"});
  visit(Field<&Point::sentinels>{
      .help = "raw values that mean a quality: { 999: sensor_failure, 0xFFFF: not_connected }"});
  visit(Field<&Point::on_fault>{
      .help = "what the point's register shows while the value is bad: nan, hold or a number"});
  visit(Field<&Point::jump>{
      .help = "largest change from the last reading that needs no second reading"});
  visit(Field<&Point::recheck>{.help = "as at a device", .fallback = "the device's"});
  visit(Field<&Point::deadband>{.help = "smaller changes are not published"});
  visit(Field<&Point::events>{.help = "an event, or a list of them, below"});
  visit(
      Field<&Point::simulate>{.help = "what a simulated device answers: a value, or [low, high]"});
  visit(Field<&Point::description>{.help = "free text for people"});
  visit(Derived<&Point::mark>());
}

/// Returns the value as people see it in every output, without its unit: "12.25", "run", "true". A
/// float without `precision` has four significant digits (ShownNumber). An empty text if there is
/// no value. The quality has no effect: of a bad value, the last value is shown.
std::string ShownText(const Point& point, const Value& value);

/// Returns "input", "holding", "discrete" or "coil": the table that the configuration names; if it
/// names none, the second table of points that can be written.
std::string_view TableName(const Point& point);

/// Returns the kinds of access that the configuration allows; nothing for a point that can only be
/// written, and must not be.
std::optional<Access> AllowedAccess(const Point& point);

/// Returns "fast", or the point's own period: "250ms".
std::string PeriodText(const Point& point);

std::string_view Name(Group group);  ///< returns "own" for Group::own and the values after it

/// Returns the type name of IEC 61131-3: "REAL", "UINT", "DT", "STRING[16]".
std::string IecName(const Point& point);

/// Returns the number of registers that a point occupies; 1 for a bit.
std::size_t RegisterCount(const Point& point);

// The registers or bits of a point in the gateway. Its address must be set (Point::modbus).

/// Returns the number of registers, or 1 for a point in a bit table.
std::size_t PlacesOf(const Point& point);
/// Returns the Modbus functions that read the point, and those that write it, the usual one first;
/// empty: none.
std::vector<int> ReadFunctions(const Point& point);
std::vector<int> WriteFunctions(const Point& point);

struct IntegerRange {
  std::int64_t lowest = 0;
  std::uint64_t highest = 0;

  bool Contains(const Decimal& whole) const;
};

/// The numbers that `read` of a point can give, before scale and offset.
struct RawNumbers {
  enum class Kind : std::uint8_t {
    any,  ///< decimal numbers, as from text
    single,
    real,
    whole,  ///< whole numbers in `range`
  } kind = Kind::any;
  IntegerRange range{};

  static RawNumbers Whole(std::int64_t lowest, std::uint64_t highest) {
    return {Kind::whole, {lowest, highest}};
  }
  /// All whole numbers of `bits` bits, 1 to 64.
  static RawNumbers Bits(unsigned bits, bool is_signed = false);
  /// True if the point can give the number. For float32 this includes 999.9, because the nearest
  /// float32 prints as 999.9.
  bool Contain(const Decimal& number) const;
};

/// Returns 0…1 for bool, and 0…0 for types that are not integers.
IntegerRange RangeOf(Type type);
/// Returns the range of the point's type; a time of day ends at midnight.
IntegerRange RangeOf(const Point& point);

}  // namespace baudgate::config
