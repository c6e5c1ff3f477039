// SPDX-License-Identifier: Apache-2.0
#include "gateway/bus/points/readings.h"

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>

#include "gateway/base/text.h"

namespace baudgate::bus {

namespace {

using config::Type;

bool IsUnscaled(const config::Point& point) { return point.scale == 1 && point.offset == 0; }

bool IsFloat(Type type) { return type == Type::float32 || type == Type::float64; }

/// Rounds a float32 to single precision, so that outputs with 32 and with 64 bits show the same
/// number. Returns no value if it is not finite.
Value FitFloat(Type type, double number) {
  const double fits = type == Type::float32 ? NearestSingle(number) : number;
  return std::isfinite(fits) ? Value(fits) : Value();
}

/// Converts a number to the type of the point, and to the alternative of `Value` for this type.
/// Returns no value if the number does not fit the type.
Value Fit(const config::Point& point, const Decimal& number) {
  const Type type = point.type;
  if (type == Type::boolean) {
    if (number == 0) return false;
    if (number == 1) return true;
    return {};
  }
  if (IsFloat(type)) return FitFloat(type, number.ToDouble());
  if (type == Type::uint64) {
    const auto whole = number.ToUint64();
    return whole ? Value(*whole) : Value();
  }
  const auto whole = number.ToInt64();
  return whole && config::RangeOf(point).Contains(*whole) ? Value(*whole) : Value();
}

Value FitNumber(const config::Point& point, const Value& raw) {
  if (const auto* number = std::get_if<double>(&raw)) {
    if (!std::isfinite(*number)) return {};
    if (IsFloat(point.type) && IsUnscaled(point)) return FitFloat(point.type, *number);
    const double meant = point.type == Type::float32 ? AsDecimal(*number) : *number;
    return Fit(point, Decimal(meant) * point.scale + point.offset);
  }
  const auto number = Decimal::Of(raw);
  return number ? Fit(point, *number * point.scale + point.offset) : Value();
}

bool FitsType(const config::Point& point, const Value& value) {
  const auto number = Decimal::Of(value);
  return number && HasValue(Fit(point, *number));
}

/// Returns the reason if a reading is above `max` or below `min`, else none. For a writable point
/// `min` and `max` limit writes only.
Reason ReasonBeyond(const config::Point& point, const Value& value) {
  const bool limited = point.writing.max || point.writing.min;
  if (!limited || point.access != config::Access::read) return Reason::none;
  const auto* const real = std::get_if<double>(&value);
  const auto number = Decimal::Of(real != nullptr ? Value(AsDecimal(*real)) : value);
  if (!number) return Reason::none;
  if (point.writing.max && *number > *point.writing.max) return Reason::over_range;
  if (point.writing.min && *number < *point.writing.min) return Reason::under_range;
  return Reason::none;
}

/// Converts a value to a text. Returns no value if the text is too long for the point, because two
/// texts that were cut could look the same.
Value FitText(const config::Point& point, const Value& raw) {
  std::string text = ToText(raw);
  return text.size() > point.text_length ? Value() : Value(std::move(text));
}

}  // namespace

Sample ToSample(const config::Point& point, const protocols::Reading& reading) {
  Sample sample;
  sample.point = static_cast<std::uint32_t>(reading.point);
  sample.quality = reading.quality;
  if (!HasValue(reading.value)) {
    // The protocol has reported no value, so the value in the point store may be wrong, and must
    // not count as good.
    if (IsGood(sample.quality)) sample.quality = Quality::bad;
    return sample;
  }
  for (const config::Sentinel& sentinel : point.sentinels) {
    if (IsMeant(reading.value, sentinel.value)) {
      sample.quality = {sentinel.quality.code, Reason::sentinel};
      return sample;
    }
  }
  sample.value =
      point.type == Type::string ? FitText(point, reading.value) : FitNumber(point, reading.value);
  if (!HasValue(sample.value)) sample.quality = {Quality::bad_configuration, Reason::out_of_range};
  const Reason beyond = IsBad(sample.quality) ? Reason::none : ReasonBeyond(point, sample.value);
  if (beyond != Reason::none) {
    sample.value = {};
    sample.quality = {Quality::bad_sensor_failure, beyond};
  }
  return sample;
}

Result<Value> ToRaw(const config::Point& point, const Value& value) {
  if (!HasValue(value)) return Error{"there is no value to write"};
  if (point.type == Type::string || std::holds_alternative<std::string>(value)) return value;
  if (!FitsType(point, value)) {
    return Error{ToText(value) + " is not a value of type " + std::string(Name(point.type))};
  }
  if (IsUnscaled(point)) return value;
  const auto number = Decimal::Of(value);
  if (!number) return Error{"the value is not a number"};
  const Decimal raw = (*number - point.offset) / point.scale;
  if (IsFloat(point.type)) {
    const double close = raw.ToDouble();
    if (!std::isfinite(close)) return Error{"the value is not a number"};
    return Value(close);
  }
  // The type is whole, so the raw value is rounded to a whole number.
  if (const auto whole = raw.ToInt64()) return Value(*whole);
  if (const auto whole = raw.ToUint64()) return Value(*whole);
  return Error{ToText(value) + " is beyond what the device can hold"};
}

bool JumpCheck::Agree(const config::Point& point, const History& history, const Value& a,
                      const Value& b) {
  if (!HasValue(a)) return false;
  if (point.type == config::Type::boolean || point.type == config::Type::string) return a == b;
  const auto first = Decimal::Of(a);
  const auto second = Decimal::Of(b);
  if (!first || !second) return false;
  Decimal jump = std::max(Abs(*first).Shifted(-1), history.largest.Shifted(-2));
  if (const config::Writing& range = point.writing; range.min && range.max) {
    jump = (*range.max - *range.min).Shifted(-1);
  }
  return Abs(*first - *second) <= point.jump.value_or(jump);
}

JumpCheck::Judgement JumpCheck::Judge(const config::Point& point, History& history,
                                      const Value& value) const {
  const bool near = Agree(point, history, history.last, value);
  const bool confirmed = Agree(point, history, history.candidate, value);
  if (confirmed || (near && point.recheck == config::Recheck::jump)) {
    history.last = value;
    history.candidate = {};
    history.readings = 0;
    history.largest = std::max(history.largest, Abs(Decimal::Of(value).value_or(0)));
    return Judgement::counts;
  }
  history.candidate = value;
  history.readings = std::min(history.readings + 1, kMostReadings);
  if (history.readings == kMostReadings) return Judgement::last_resort;
  return near ? Judgement::wait : Judgement::doubt;
}

JumpCheck::Result JumpCheck::Check(std::vector<Sample>& samples) {
  Result result;
  // The device marks readings as uncertain while the measured value changes, so a jump is not
  // damage.
  const bool changes = std::ranges::any_of(
      samples, [](const Sample& sample) { return IsUncertain(sample.quality); });
  std::erase_if(samples, [&](Sample& sample) {
    const config::Point& point = points_[sample.point];
    if (point.recheck == config::Recheck::off || !IsGood(sample.quality)) return false;
    if (histories_.empty()) histories_.resize(points_.size());
    History& history = histories_[sample.point];
    const bool steady = !std::exchange(history.changes, changes) && !changes;
    const bool jumped = steady && HasValue(history.candidate) && HasValue(history.last);
    // If the second reading agrees neither with the last value nor with the jump, the measured
    // value itself moves, and no damage is counted.
    const bool returned = jumped && Agree(point, history, history.last, sample.value) &&
                          !Agree(point, history, history.candidate, sample.value);
    result.unconfirmed = result.unconfirmed || returned;
    switch (Judge(point, history, sample.value)) {
      case Judgement::counts:
        return false;
      case Judgement::last_resort:
        sample.quality = Quality::uncertain;
        if (IsSeldom(point.group)) result.spoils = point.group;
        return false;
      case Judgement::doubt:
        result.doubtful.push_back(sample.point);
        break;
      case Judgement::wait:
        break;
    }
    result.ask_again = true;
    return true;
  });
  return result;
}

void JumpCheck::OnWritten(std::size_t point, Value value) {
  if (points_[point].recheck == config::Recheck::off) return;
  if (histories_.empty()) histories_.resize(points_.size());
  histories_[point].candidate = std::move(value);
  histories_[point].readings = 0;
}

}  // namespace baudgate::bus
