// `Value` is one value of a point, as it is read, stored, served and written. `Quality` is how far
// a value can be trusted.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <variant>

namespace baudgate {

/// A value, or std::monostate while there is no value. Integers of every width are stored as
/// std::int64_t, except unsigned integers of 64 bits.
using Value = std::variant<std::monostate, bool, std::int64_t, std::uint64_t, double, std::string>;

inline bool HasValue(const Value& value) { return value.index() != 0; }

/// Returns the value as a number: a boolean is 0 or 1; a text and an empty value are NaN.
double ToDouble(const Value& value);

/// Returns the value for people: "0.52", "true", "SPCJ 4D29"; an empty text for an empty value.
std::string ToText(const Value& value);

// The quality of a point's value: an OPC DA code, and for a bad value the reason. The numbers are a
// public contract (docs/modbus.md, docs/dds.md): the code is the low byte, the reason the high
// byte.
//
//   0x0310 = open sensor, sensor failure        0x00C0 = good

/// Why a value is not good, in more detail than Quality::Code.
enum class Reason : std::uint8_t {
  none = 0,
  over_range = 1,
  under_range = 2,
  open_sensor = 3,
  channel_disabled = 4,
  not_fitted = 5,  ///< the device has no such channel or value
  not_ready = 6,   ///< the device cannot give the value yet, or not now
  device_fault = 7,
  other_module = 8,  ///< the device has another type than its profile
  swapped = 9,       ///< another device answers in its place
  password_refused = 10,
  no_permission = 11,
  sentinel = 12,      ///< a number that stands for no measurement
  out_of_range = 13,  ///< beyond the range of the point's type
};

/// Returns the name for people: "over range", "open sensor", …; an empty text for Reason::none.
std::string_view Name(Reason reason);

/// True for reasons with which Modbus registers show what `on_bad` of the device says; for other
/// faults they show what `on_fault` of the point says. The reasons mostly concern a whole device;
/// other_module can also concern one input of a wrong type.
constexpr bool ConcernsDevice(Reason reason) {
  return reason == Reason::other_module || reason == Reason::swapped ||
         reason == Reason::password_refused || reason == Reason::no_permission;
}

struct Quality {
  enum Code : std::uint8_t {
    bad = 0x00,
    bad_configuration = 0x04,
    bad_not_connected = 0x08,
    bad_device_failure = 0x0C,
    bad_sensor_failure = 0x10,
    bad_last_known = 0x14,
    bad_communication = 0x18,
    bad_out_of_service = 0x1C,
    bad_waiting = 0x20,  ///< the initial quality of every point
    uncertain = 0x40,
    uncertain_last_usable = 0x44,
    uncertain_sub_normal = 0x58,
    good = 0xC0,
  };

  Code code = bad;
  Reason reason = Reason::none;

  constexpr Quality() = default;
  constexpr Quality(Code its_code, Reason why = Reason::none) : code(its_code), reason(why) {}

  constexpr std::uint16_t word() const {
    return static_cast<std::uint16_t>(static_cast<unsigned>(reason) << 8U | code);
  }
  static constexpr Quality OfWord(std::uint16_t word) {
    return {static_cast<Code>(word & 0xFFU), static_cast<Reason>(word >> 8U)};
  }

  bool operator==(const Quality&) const = default;
  constexpr bool operator==(Code other) const { return code == other; }
  /// A worse quality is less.
  constexpr bool operator<(const Quality& other) const { return code < other.code; }
};

constexpr Quality QualityOfDevice(Reason reason) {
  switch (reason) {
    case Reason::other_module:
      return {Quality::bad_configuration, reason};
    case Reason::swapped:
      return {Quality::bad_device_failure, reason};
    default:
      return {Quality::bad_communication, reason};
  }
}

constexpr bool IsGood(Quality quality) { return (quality.code & 0xC0U) == 0xC0U; }
constexpr bool IsUncertain(Quality quality) { return (quality.code & 0xC0U) == 0x40U; }
constexpr bool IsBad(Quality quality) { return (quality.code & 0xC0U) == 0; }

/// Returns the name for people: "good", "uncertain: last usable", "bad: sensor failure, open
/// sensor", …
std::string Name(Quality quality);

}  // namespace baudgate
