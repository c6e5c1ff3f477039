// SPDX-License-Identifier: Apache-2.0
#include "gateway/writes/write_limits.h"

#include <cmath>
#include <limits>

#include "gateway/base/text.h"
#include "gateway/store/conversion.h"

namespace baudgate {
namespace {

/// 0.3 is a multiple of 0.1, although 0.3 / 0.1 is 2.9999999999999996.
constexpr double kExact = 1e-9;

std::string WithUnit(const config::Point& point, double number) {
  return FormatNumber(number) + (point.unit.empty() ? "" : " " + point.unit);
}

}  // namespace

Value AsMeant(const config::Point& point, const Value& value) {
  const auto* number = std::get_if<double>(&value);
  if (number == nullptr || point.type != config::Type::float32) return value;
  return AsDecimal(*number);
}

std::string WhyInexact(const config::Point& point, const Value& value, const Value& raw) {
  const Value back = ToSample(point, {0, raw}).value;
  if (!HasValue(back)) return ToText(value) + " means something else to this device";
  const double number = ToDouble(value);
  if (std::isnan(number)) return {};  // a text
  const double slack = kExact * (std::abs(number) + std::abs(point.offset));
  if (std::abs(ToDouble(back) - number) > slack) {
    return "the device can not be set to " + FormatNumber(number) + ", but to " + ToText(back);
  }
  if (!point.writing.decimals) return {};
  const double digits = ToDouble(raw) * std::pow(10.0, *point.writing.decimals);
  if (std::abs(digits - std::round(digits)) <= kExact * std::max(1.0, std::abs(digits))) return {};
  return FormatNumber(number) + " has more digits than the device takes, " +
         std::to_string(*point.writing.decimals) + " behind its decimal point";
}

std::string WhyOutside(const config::Point& point, const Value& value) {
  const config::Writing& writing = point.writing;
  const double number = ToDouble(value);
  if (std::isnan(number)) return {};  // a text
  const bool single = point.type == config::Type::float32;
  if (single && number != 0 && std::abs(number) < std::numeric_limits<float>::min()) {
    return FormatNumber(number) + " is next to nothing: are the words of the float in order?";
  }
  if (writing.min && number < *writing.min) {
    return FormatNumber(number) + " is below the least that may be written, " +
           WithUnit(point, *writing.min);
  }
  if (writing.max && number > *writing.max) {
    return FormatNumber(number) + " is above the most that may be written, " +
           WithUnit(point, *writing.max);
  }
  if (!writing.step) return {};
  const double steps = number / *writing.step;
  if (std::abs(steps - std::round(steps)) <= kExact * std::max(1.0, std::abs(steps))) return {};
  return FormatNumber(number) + " is no multiple of " + WithUnit(point, *writing.step);
}

}  // namespace baudgate
