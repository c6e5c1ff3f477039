// SPDX-License-Identifier: Apache-2.0
#include "gateway/bus/writes/write_limits.h"

#include <algorithm>
#include <limits>

#include "gateway/base/decimal.h"
#include "gateway/base/text.h"
#include "gateway/bus/points/conversion.h"

namespace baudgate {
namespace {

/// How far a number that a client has computed may be from the one that it means: 0.1 + 0.2 is
/// 0.30000000000000004. Whole numbers are meant as they are.
Decimal SlackOf(const Value& value, const Decimal& size) {
  constexpr int kDigits = 9;
  return std::holds_alternative<double>(value) ? Abs(size).Shifted(-kDigits) : Decimal();
}

bool IsMultiple(const Value& value, const Decimal& number, const Decimal& step) {
  if (number.IsMultipleOf(step)) return true;
  const auto steps = (number / step).ToInt64();
  return steps && Abs(number - *steps * step) <= SlackOf(value, std::max(Abs(number), step));
}

}  // namespace

std::string WithUnit(const config::Point& point, const Decimal& number) {
  return number.ToText() + (point.unit.empty() ? "" : " " + point.unit);
}

Value AsMeant(const config::Point& point, const Value& value) {
  const auto* number = std::get_if<double>(&value);
  if (number == nullptr || point.type != config::Type::float32) return value;
  return AsDecimal(*number);
}

std::optional<std::string> WhyInexact(const config::Point& point, const Value& value,
                                      const Value& raw) {
  const Value back = ToSample(point, {0, raw}).value;
  if (!HasValue(back)) return ToText(value) + " is a code that has another meaning for this device";
  auto number = Decimal::Of(value);
  if (!number) return std::nullopt;  // a text
  if (point.type == config::Type::float32) number = Decimal(NearestSingle(number->ToDouble()));
  const Decimal difference = Abs(Decimal::Of(back).value_or(0) - *number);
  if (difference > SlackOf(value, Abs(*number) + Abs(point.offset))) {
    return "the device cannot represent " + number->ToText() + "; the nearest value is " +
           ToText(back);
  }
  const auto digits = Decimal::Of(raw);
  if (!point.writing.decimals || !digits) return std::nullopt;
  if (IsMultiple(raw, *digits, Decimal(1).Shifted(-*point.writing.decimals))) {
    return std::nullopt;
  }
  return number->ToText() + " has more digits than the device takes, " +
         std::to_string(*point.writing.decimals) + " behind its decimal point";
}

std::optional<std::string> WhyOutside(const config::Point& point, const Value& value) {
  const config::Writing& writing = point.writing;
  const auto number = Decimal::Of(value);
  if (!number) {
    if (std::holds_alternative<std::string>(value)) return std::nullopt;
    return "it is not a number";
  }
  const bool single = point.type == config::Type::float32;
  const double size = Abs(*number).ToDouble();
  if (single && size != 0 && size < std::numeric_limits<float>::min()) {
    return number->ToText() + " is almost zero: is the word order of the float right?";
  }
  if (writing.min && *number < *writing.min) {
    return number->ToText() + " is below the minimum, " + WithUnit(point, *writing.min);
  }
  if (writing.max && *number > *writing.max) {
    return number->ToText() + " is above the maximum, " + WithUnit(point, *writing.max);
  }
  if (!writing.step || IsMultiple(value, *number, *writing.step)) return std::nullopt;
  return number->ToText() + " is not a multiple of " + WithUnit(point, *writing.step);
}

}  // namespace baudgate
