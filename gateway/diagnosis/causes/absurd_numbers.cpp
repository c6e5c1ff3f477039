// SPDX-License-Identifier: Apache-2.0
#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>
#include <iterator>
#include <map>
#include <optional>
#include <string_view>
#include <utility>

#include "gateway/base/text.h"
#include "gateway/diagnosis/causes/diagnose_parts.h"

namespace baudgate::control {
namespace {

/// No device measures less, apart from nothing at all, or more.
constexpr double kLeastMeasured = 1e-20;
constexpr double kMostMeasured = 1e20;
/// So much do most devices measure.
constexpr double kLeastUsual = 1e-4;
constexpr double kMostUsual = 1e7;
/// A negative number in an unsigned type is hardly further below zero, beside numbers as small.
constexpr double kSmall = 1000;
/// Registers of a row are no further apart.
constexpr int kNextTo = 4;

/// "holding " and 40.
using Place = std::pair<std::string, int>;

/// A number of four bytes, as it was read.
struct Float {
  std::optional<Place> place;
  std::uint32_t bits;
};

std::optional<Place> PlaceOf(const config::Point& point) {
  const std::size_t end = point.read.find_last_not_of("0123456789") + 1;
  const auto number = ParseInteger<int>(std::string_view(point.read).substr(end));
  return number ? std::optional(Place(point.read.substr(0, end), *number)) : std::nullopt;
}

bool IsUsual(std::uint32_t bits) {
  const double size = std::abs(std::bit_cast<float>(bits));
  return size == 0 || (size >= kLeastUsual && size <= kMostUsual);
}

/// The order of bytes that is set at the device; empty: none, or the one that it would have anyway.
std::string SetOrder(const config::Device& device) {
  const auto order = device.options.all().find("order");
  if (!device.traits->has_byte_order || order == device.options.all().end()) return {};
  const auto* const name = std::get_if<std::string>(&order->second);
  return name == nullptr || *name == Name(config::WordOrder::abcd) ? std::string() : *name;
}

/// The order of bytes in which all of these numbers are usual ones. Empty: none, more than one, or
/// the device has no such setting, or another one than the first.
std::string OrderOf(const config::Device& device, const std::vector<Float>& numbers) {
  using enum config::WordOrder;
  if (!device.traits->has_byte_order || !SetOrder(device).empty()) return {};
  std::string_view found;
  for (const config::WordOrder one : {cdab, badc, dcba}) {
    const std::string_view other = Name(one);
    const bool all = std::ranges::all_of(numbers, [&](const Float& number) {
      std::uint32_t turned = 0;
      for (const char place : other) {
        const int byte = place - 'A';  // 0: the first of the four, as they came
        turned = turned << 8U | (number.bits >> (8U * (3U - static_cast<unsigned>(byte))) & 0xFFU);
      }
      return IsUsual(turned);
    });
    if (!all) continue;
    if (!found.empty()) return {};
    found = other;
  }
  return std::string(found);
}

/// The second half of each and the first half of the next make usual numbers, as they do where each
/// was read one register too far. Swapped words look alike, unless nothing (0) stands at the end.
bool AreShifted(const std::vector<Float>& numbers) {
  bool any = false;
  for (const Float& number : numbers) {
    const auto next = std::ranges::find_if(numbers, [&](const Float& other) {
      return number.place && other.place && other.place->first == number.place->first &&
             other.place->second == number.place->second + 2;
    });
    if (next == numbers.end()) continue;
    const std::uint32_t joined = number.bits << 16U | next->bits >> 16U;
    if (joined == 0 || !IsUsual(joined)) return false;
    any = true;
  }
  return any;
}

/// Why an integer cannot be true; empty: it can. `small`: others beside it are.
std::string WhyImpossible(const config::Point& point, double raw, bool small) {
  using enum config::Type;
  const bool is_signed = point.type == int16 || point.type == int32;
  const bool is_short = point.type == int16 || point.type == uint16;
  if (!is_short && !is_signed && point.type != uint32) return {};
  const double values = is_short ? 0x1p16 : 0x1p32;
  const bool ones = !is_signed && raw == values - 1 && (!is_short || !point.unit.empty());
  if (raw == values / 2 - 1 || (is_signed && raw == -values / 2) || ones) {
    return "it stands for no measurement: look at what is measured, and add it to its sentinels";
  }
  if (is_signed || raw < values - kSmall || raw == values - 1 || !small) return {};
  return fmt::format("it is {:.0f} as a signed number: set type: {} in the profile", raw - values,
                     is_short ? "int16" : "int32");
}

}  // namespace

std::string OffByOne(const DeviceRecord& record, std::size_t least) {
  std::map<std::string, std::map<int, std::size_t>> rows;
  for (std::size_t i = 0; i < record.points.size(); ++i) {
    if (const auto place = PlaceOf(record.device->points[i])) rows[place->first][place->second] = i;
  }
  const auto is_refused = [&](const auto& entry) {
    const PointRecord& point = record.points[entry.second];
    return point.reported.reason == Reason::not_fitted && !HasValue(point.value);
  };
  for (const auto& [kind, row] : rows) {
    if (row.size() < least || std::ranges::count_if(row, is_refused) != 1) continue;
    const bool last = is_refused(*row.rbegin());
    if (!last && !is_refused(*row.begin())) continue;
    const auto end = last ? std::prev(row.end()) : row.begin();
    const auto next = last ? std::prev(end) : std::next(end);
    if (std::abs(next->first - end->first) > kNextTo) continue;
    const config::Point& point = record.device->points[end->second];
    return fmt::format(
        "only the {} address is refused ({}, {}): its addresses are off by one: {} each by one in "
        "the profile",
        last ? "last" : "first", point.name, point.read, last ? "lower" : "raise");
  }
  return {};
}

std::vector<std::string> AbsurdNumbers(const DeviceRecord& record, Now now) {
  struct Number {
    const config::Point& point;
    double shown;
    double raw;
  };
  std::vector<Number> numbers;
  std::vector<Float> floats;
  bool small = false;
  for (std::size_t i = 0; i < record.points.size(); ++i) {
    const config::Point& point = record.device->points[i];
    const double shown = ToDouble(record.points[i].value);
    const double raw = (shown - point.offset.ToDouble()) / point.scale.ToDouble();
    if (point.type == config::Type::boolean || !std::isfinite(raw)) continue;
    if (!IsGood(QualityAt(record, i, now.instant))) continue;
    numbers.push_back({point, shown, raw});
    small = small || std::abs(raw) <= kSmall;
    if (point.type != config::Type::float32) continue;
    floats.push_back({PlaceOf(point), std::bit_cast<std::uint32_t>(static_cast<float>(raw))});
  }
  std::size_t absurd = 0;
  std::string first;
  std::string why;  // of an integer
  for (const auto& [point, shown, raw] : numbers) {
    const double size = std::abs(shown);
    const bool is_float =
        point.type == config::Type::float32 || point.type == config::Type::float64;
    const std::string impossible = WhyImpossible(point, raw, small);
    const bool fits = !is_float || size == 0 || (size >= kLeastMeasured && size <= kMostMeasured);
    if (impossible.empty() && fits) continue;
    if (++absurd > 1) continue;
    first = fmt::format("{}: {:.{}g}", point.name, shown, is_float ? 3 : 10);
    why = impossible;
  }
  if (absurd == 0 || (why.empty() && !OffByOne(record, 2).empty())) return {};
  const std::string order = OrderOf(*record.device, floats);
  const bool shifted = AreShifted(floats);
  const std::string set = SetOrder(*record.device);
  const bool either = shifted && floats.back().bits != 0 && (!order.empty() || !set.empty());
  if (why.empty() && either) {
    // The registers are the same for both, so one cure makes wrong numbers that look right.
    why = (order.empty() ? "take order: " + set + " out" : "set order: " + order) +
          ", or correct their addresses by one register: both make usual numbers, so compare with "
          "its display";
  } else if (why.empty()) {
    why = shifted ? "read one register lower (or higher) they fit: correct their addresses"
          : order.empty()
              ? "check the order of their bytes (order), their type and their register"
              : "their bytes come in another order: set order: " + order + " in the configuration";
  }
  return {fmt::format("{} of {} numbers cannot be true ({}{}): {}", absurd, numbers.size(), first,
                      absurd > 1 ? ", ..." : "", why)};
}

}  // namespace baudgate::control
