// SPDX-License-Identifier: Apache-2.0
#include "config/model/point.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "gateway/base/shown.h"

namespace baudgate::config {
namespace {

template <typename T>
constexpr IntegerRange RangeOf() {
  return {static_cast<std::int64_t>(std::numeric_limits<T>::min()),
          static_cast<std::uint64_t>(std::numeric_limits<T>::max())};
}

}  // namespace

std::string_view Name(Group group) {
  if (group == Group::again) return "again";
  return group < Group::own ? kWords<Group>[static_cast<std::size_t>(group)].word : "own";
}

namespace {

bool IsFloat(Type type) { return type == Type::float32 || type == Type::float64; }

std::optional<std::int64_t> WholeOf(const Value& value) {
  const auto number = Decimal::Of(value);
  if (!number || !number->is_whole()) return std::nullopt;
  return number->ToInt64();
}

}  // namespace

std::string ShownText(const Point& point, const Value& value) {
  if (point.states) {
    const auto whole = WholeOf(value);
    const auto found = std::ranges::find_if(
        *point.states, [&](const StateText& state) { return whole == state.value; });
    if (found != point.states->end()) return found->text;
  }
  const auto* number = std::get_if<double>(&value);
  if (number == nullptr) return ToText(value);
  std::optional<int> decimals;
  if (!IsFloat(point.type) && std::trunc(*number) == *number) decimals = 0;
  if (point.precision) decimals = *point.precision;
  return ShownNumber(*number, decimals);
}

std::string_view TableName(const Point& point) {
  const bool second = point.second_table || point.access != Access::read;
  if (point.table == Table::bits) return second ? "coil" : "discrete";
  return second ? "holding" : "input";
}

std::optional<Access> AllowedAccess(const Point& point) {
  if (point.writing.allowed) return point.access;
  return point.access == Access::write ? std::nullopt : std::optional(Access::read);
}

std::size_t PlacesOf(const Point& point) {
  return point.table == Table::bits ? 1 : RegisterCount(point);
}

std::vector<int> ReadFunctions(const Point& point) {
  if (point.access == Access::write) return {};
  return point.table == Table::bits ? std::vector{2, 1} : std::vector{4, 3};
}

std::vector<int> WriteFunctions(const Point& point) {
  if (!point.writing.allowed) return {};
  if (point.table == Table::bits) return {5, 15};
  return PlacesOf(point) == 1 ? std::vector{6, 16} : std::vector{16};
}

std::string PeriodText(const Point& point) {
  return point.poll ? FormatDuration(*point.poll) : std::string(Name(point.group));
}

std::string IecName(const Point& point) {
  switch (point.time_type) {
    case TimeType::time:
      return "TIME";
    case TimeType::date:
      return "DATE";
    case TimeType::time_of_day:
      return "TOD";
    case TimeType::date_time:
      return "DT";
    case TimeType::none:
      break;
  }
  if (point.type == Type::string) return "STRING[" + std::to_string(point.text_length) + "]";
  static constexpr std::string_view kNames[] = {"BOOL",  "SINT", "USINT", "INT",  "UINT", "DINT",
                                                "UDINT", "LINT", "ULINT", "REAL", "LREAL"};
  return std::string(kNames[static_cast<std::size_t>(point.type)]);
}

std::size_t RegisterCount(const Point& point) {
  switch (point.type) {
    case Type::boolean:
    case Type::int8:
    case Type::uint8:
    case Type::int16:
    case Type::uint16:
      return 1;
    case Type::int32:
    case Type::uint32:
    case Type::float32:
      return 2;
    case Type::int64:
    case Type::uint64:
    case Type::float64:
      return 4;
    case Type::string:
      return (point.text_length + 1) / 2;
  }
  return 1;
}

bool IntegerRange::Contains(const Decimal& whole) const {
  return whole >= lowest && whole <= highest;
}

RawNumbers RawNumbers::Bits(unsigned bits, bool is_signed) {
  const unsigned unused = 64 - bits;
  const std::uint64_t all = std::numeric_limits<std::uint64_t>::max() >> unused;
  if (!is_signed) return Whole(0, all);
  return Whole(std::numeric_limits<std::int64_t>::min() >> unused, all / 2);
}

bool RawNumbers::Contain(const Decimal& number) const {
  if (kind == Kind::whole) return number.is_whole() && range.Contains(number);
  if (kind != Kind::single) return true;
  const double nearest = NearestSingle(number.ToDouble());
  return std::isfinite(nearest) &&
         IsMeant(static_cast<double>(static_cast<float>(nearest)), number);
}

IntegerRange RangeOf(Type type) {
  switch (type) {
    case Type::boolean:
      return {0, 1};
    case Type::int8:
      return RangeOf<std::int8_t>();
    case Type::uint8:
      return RangeOf<std::uint8_t>();
    case Type::int16:
      return RangeOf<std::int16_t>();
    case Type::uint16:
      return RangeOf<std::uint16_t>();
    case Type::int32:
      return RangeOf<std::int32_t>();
    case Type::uint32:
      return RangeOf<std::uint32_t>();
    case Type::int64:
      return RangeOf<std::int64_t>();
    case Type::uint64:
      return RangeOf<std::uint64_t>();
    case Type::float32:
    case Type::float64:
    case Type::string:
      break;
  }
  return {};
}

IntegerRange RangeOf(const Point& point) {
  constexpr std::uint64_t kLastOfADay = 24ULL * 3600 * 1000 - 1;
  if (point.time_type == TimeType::time_of_day) return {0, kLastOfADay};
  return RangeOf(point.type);
}

}  // namespace baudgate::config
