// SPDX-License-Identifier: Apache-2.0
#include "gateway/store/conversion.h"

#include <array>
#include <charconv>
#include <cmath>
#include <limits>

namespace baudgate {
namespace {

using config::Type;

bool IsUnscaled(const config::Point& point) { return point.scale == 1 && point.offset == 0; }

/// A number in the alternative that the point's type is stored in, or nothing when it does not fit.
Value Fit(Type type, double number) {
  if (type == Type::boolean) {
    if (number == 0) return false;
    if (number == 1) return true;
    return {};
  }
  if (type == Type::float64) return std::isfinite(number) ? Value(number) : Value();
  if (type == Type::float32) {
    return std::abs(number) <= std::numeric_limits<float>::max() ? Value(number) : Value();
  }
  const double whole = std::round(number);
  if (!config::RangeOf(type).Contains(whole)) return {};
  if (type == Type::uint64) return static_cast<std::uint64_t>(whole);
  return static_cast<std::int64_t>(whole);
}

/// 64-bit integers pass whole where a double would round them.
Value FitInteger(const config::Point& point, const Value& raw) {
  if (const auto* number = std::get_if<std::uint64_t>(&raw);
      number != nullptr && IsUnscaled(point)) {
    if (point.type == Type::uint64) return raw;
    if (point.type == Type::int64) {
      if (*number > static_cast<std::uint64_t>(std::numeric_limits<std::int64_t>::max())) return {};
      return static_cast<std::int64_t>(*number);
    }
  }
  if (const auto* number = std::get_if<std::int64_t>(&raw);
      number != nullptr && IsUnscaled(point)) {
    if (point.type == Type::int64) return raw;
    if (point.type == Type::uint64 && *number >= 0) return static_cast<std::uint64_t>(*number);
  }
  const bool may_be_single = point.type == Type::float32 && std::holds_alternative<double>(raw);
  const double number = may_be_single ? AsDecimal(ToDouble(raw)) : ToDouble(raw);
  return Fit(point.type, number * point.scale + point.offset);
}

/// A value in user's units that the point could hold; exact where it is an integer already.
bool FitsType(Type type, const Value& value) {
  if (std::holds_alternative<std::int64_t>(value) && type == Type::int64) return true;
  if (std::holds_alternative<std::uint64_t>(value) && type == Type::uint64) return true;
  return HasValue(Fit(type, ToDouble(value)));
}

Value FitText(const config::Point& point, const Value& raw) {
  std::string text = ToText(raw);
  if (text.size() > point.text_length) text.resize(point.text_length);
  return text;
}

}  // namespace

Sample ToSample(const config::Point& point, const Reading& reading) {
  Sample sample;
  sample.point = static_cast<std::uint32_t>(reading.point);
  sample.quality = reading.quality;
  if (!HasValue(reading.value)) {
    // A device that gives no value can not vouch for the last one.
    if (IsGood(sample.quality)) sample.quality = Quality::bad;
    return sample;
  }
  if (point.type == Type::string) {
    sample.value = FitText(point, reading.value);
    return sample;
  }
  for (const config::Sentinel& sentinel : point.sentinels) {
    if (ToDouble(reading.value) == sentinel.value) {
      sample.quality = {sentinel.quality.code, Reason::sentinel};
      return sample;
    }
  }
  sample.value = FitInteger(point, reading.value);
  if (!HasValue(sample.value)) sample.quality = {Quality::bad_configuration, Reason::out_of_range};
  return sample;
}

Result<Value> ToRaw(const config::Point& point, const Value& value) {
  if (!HasValue(value)) return Error{"there is no value to write"};
  if (point.type == Type::string || std::holds_alternative<std::string>(value)) return value;
  if (!FitsType(point.type, value)) {
    return Error{ToText(value) + " is not a value of type " + std::string(Name(point.type))};
  }
  if (IsUnscaled(point)) return value;
  const double raw = (ToDouble(value) - point.offset) / point.scale;
  if (!std::isfinite(raw)) return Error{"the value is not a number"};
  if (point.type == Type::float32 || point.type == Type::float64) return Value(raw);
  // Scaling is for people; what the device counts in is whole where its type is.
  Value whole = Fit(Type::int64, raw);
  if (!HasValue(whole)) return Error{ToText(value) + " is beyond what the device can hold"};
  return whole;
}

double AsDecimal(double number) {
  constexpr int kDigits = std::numeric_limits<float>::max_digits10;
  std::array<char, 32> text{};
  const auto read = [&](char* end) {
    double value = number;
    std::from_chars(text.data(), end, value);
    return value;
  };
  char* const last = text.data() + text.size();
  const bool is_short =
      read(std::to_chars(text.data(), last, number, std::chars_format::general, kDigits).ptr) ==
      number;
  if (is_short || std::abs(number) > std::numeric_limits<float>::max()) return number;
  const auto single = static_cast<float>(number);
  if (static_cast<double>(single) != number) return number;
  return read(std::to_chars(text.data(), last, single).ptr);
}

}  // namespace baudgate
