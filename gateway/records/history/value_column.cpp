// SPDX-License-Identifier: Apache-2.0
#include "gateway/records/history/value_column.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <limits>
#include <optional>

namespace baudgate::history {
namespace {

constexpr std::array<double, 7> kPowers = {1, 10, 100, 1e3, 1e4, 1e5, 1e6};
constexpr std::array<double, 7> kScales = {1, 0.1, 0.01, 1e-3, 1e-4, 1e-5, 1e-6};
/// Beyond it a double has no tenths that are exact.
constexpr double kMostWhole = 1e15;

bool IsSame(double a, double b) {
  return std::bit_cast<std::uint64_t>(a) == std::bit_cast<std::uint64_t>(b);
}

double Number(ValueForm form, std::int64_t whole) {
  const auto number = static_cast<double>(whole);
  return form.code == ValueCode::divided ? number / kPowers[form.decimals]
                                         : number * kScales[form.decimals];
}

/// Empty: this form does not bring it back.
std::optional<std::int64_t> WholeOf(ValueForm form, double number) {
  const double whole = number * kPowers[form.decimals];
  if (!(std::abs(whole) < kMostWhole)) return std::nullopt;
  const auto rounded = static_cast<std::int64_t>(std::llround(whole));
  if (!IsSame(Number(form, rounded), number)) return std::nullopt;
  return rounded;
}

bool Fits(ValueForm form, std::span<const Value> values) {
  return std::ranges::all_of(values, [&](const Value& value) {
    return WholeOf(form, std::get<double>(value)).has_value();
  });
}

bool IsSingle(const Value& value) {
  const double number = std::get<double>(value);
  if (!(std::abs(number) <= std::numeric_limits<float>::max())) return false;
  return IsSame(static_cast<double>(static_cast<float>(number)), number);
}

ValueForm FormOfDoubles(std::span<const Value> values) {
  for (std::uint8_t decimals = 0; decimals < kPowers.size(); ++decimals) {
    for (const ValueCode code : {ValueCode::divided, ValueCode::scaled}) {
      if (Fits({code, decimals}, values)) return {code, decimals};
    }
  }
  return {std::ranges::all_of(values, IsSingle) ? ValueCode::single : ValueCode::real, 0};
}

ValueCode CodeOf(const Value& value) {
  constexpr std::array<ValueCode, 6> kCodes = {ValueCode::none,  ValueCode::flag,
                                               ValueCode::whole, ValueCode::counter,
                                               ValueCode::real,  ValueCode::text};
  return kCodes[value.index()];
}

/// A value as the number whose differences are written. Not of text.
std::int64_t BitsOf(ValueForm form, const Value& value) {
  switch (form.code) {
    case ValueCode::flag:
      return std::get<bool>(value) ? 1 : 0;
    case ValueCode::whole:
      return std::get<std::int64_t>(value);
    case ValueCode::counter:
      return static_cast<std::int64_t>(std::get<std::uint64_t>(value));
    case ValueCode::divided:
    case ValueCode::scaled:
      return WholeOf(form, std::get<double>(value)).value_or(0);
    case ValueCode::single:
      return std::bit_cast<std::int32_t>(static_cast<float>(std::get<double>(value)));
    default:
      return std::bit_cast<std::int64_t>(std::get<double>(value));
  }
}

Value ValueOf(ValueForm form, std::int64_t bits) {
  switch (form.code) {
    case ValueCode::flag:
      return bits != 0;
    case ValueCode::whole:
      return bits;
    case ValueCode::counter:
      return static_cast<std::uint64_t>(bits);
    case ValueCode::divided:
    case ValueCode::scaled:
      return Number(form, bits);
    case ValueCode::single:
      return static_cast<double>(std::bit_cast<float>(static_cast<std::int32_t>(bits)));
    default:
      return std::bit_cast<double>(bits);
  }
}

bool IsKnown(ValueForm form) {
  return form.code > ValueCode::none && form.code <= ValueCode::mixed &&
         form.decimals < kPowers.size();
}

}  // namespace

ValueForm FormOf(std::span<const Value> values) {
  if (values.empty()) return {};
  const ValueCode code = CodeOf(values.front());
  const bool alike =
      std::ranges::all_of(values, [&](const Value& value) { return CodeOf(value) == code; });
  if (!alike) return {ValueCode::mixed, 0};
  return code == ValueCode::real ? FormOfDoubles(values) : ValueForm{code, 0};
}

void WriteValues(ValueForm form, std::span<const Value> values, ColumnWriter& to) {
  std::int64_t before = 0;
  for (const Value& value : values) {
    ValueForm its = form;
    if (form.code == ValueCode::mixed) {
      its.code = CodeOf(value);
      to.Unsigned(static_cast<std::uint64_t>(its.code));
      before = 0;
    }
    if (its.code == ValueCode::text) {
      to.Text(std::get<std::string>(value));
      continue;
    }
    const std::int64_t bits = BitsOf(its, value);
    to.Signed(WrapSub(bits, before));
    before = bits;
  }
}

std::vector<Value> ReadValues(ValueForm form, std::size_t count, ColumnReader& from) {
  std::vector<Value> values;
  if (count > 0 && !IsKnown(form)) from.Fail();
  std::int64_t before = 0;
  while (from.ok() && values.size() < count) {
    ValueForm its = form;
    if (form.code == ValueCode::mixed) {
      its.code = static_cast<ValueCode>(std::min<std::uint64_t>(from.Unsigned(), 255));
      before = 0;
      if (!IsKnown(its) || its.code == ValueCode::mixed) from.Fail();
    }
    if (its.code == ValueCode::text) {
      values.emplace_back(from.Text());
    } else {
      before = WrapAdd(before, from.Signed());
      values.push_back(ValueOf(its, before));
    }
  }
  return values;
}

}  // namespace baudgate::history
