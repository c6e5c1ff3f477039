// SPDX-License-Identifier: Apache-2.0
#include "gateway/status/absurd_numbers.h"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>
#include <string_view>
#include <variant>

namespace baudgate::control {
namespace {

/// No device measures less, apart from nothing at all, or more.
constexpr double kLeastMeasured = 1e-20;
constexpr double kMostMeasured = 1e20;

/// So much do most devices measure.
constexpr double kLeastUsual = 1e-4;
constexpr double kMostUsual = 1e7;

bool IsUsual(double number) {
  const double size = std::abs(number);
  return size == 0 || (size >= kLeastUsual && size <= kMostUsual);
}

/// The order of bytes in which all of these numbers of four bytes are usual ones. Empty: none, more
/// than one, or the device has no such setting, or another one than the first.
std::string OrderOf(const config::Device& device, const std::vector<double>& numbers) {
  using enum config::WordOrder;
  const auto order = device.options.all().find("order");
  const bool first = order == device.options.all().end() ||
                     order->second == config::OptionValue(std::string(Name(abcd)));
  if (!device.traits->has_byte_order || !first) return {};
  std::string_view found;
  for (const config::WordOrder one : {cdab, badc, dcba}) {
    const std::string_view other = Name(one);
    const bool all = std::ranges::all_of(numbers, [&](double number) {
      const auto bits = std::bit_cast<std::uint32_t>(static_cast<float>(number));
      std::uint32_t turned = 0;
      for (const char place : other) {
        const int byte = place - 'A';  // 0: the first of the four, as they came
        turned = turned << 8U | (bits >> (8U * (3U - static_cast<unsigned>(byte))) & 0xFFU);
      }
      return IsUsual(std::bit_cast<float>(turned));
    });
    if (!all) continue;
    if (!found.empty()) return {};
    found = other;
  }
  return std::string(found);
}

}  // namespace

std::vector<std::string> AbsurdNumbers(const DeviceRecord& record, Now now) {
  std::size_t numbers = 0;
  std::size_t absurd = 0;
  std::string first;
  std::vector<double> floats;  // of four bytes, as they were read
  for (std::size_t i = 0; i < record.points.size(); ++i) {
    const config::Point& point = record.device->points[i];
    const auto* const number = std::get_if<double>(&record.points[i].value);
    const bool is_float =
        point.type == config::Type::float32 || point.type == config::Type::float64;
    if (!is_float || number == nullptr || !IsGood(QualityAt(record, i, now.instant))) continue;
    ++numbers;
    if (point.type == config::Type::float32 && point.scale == 1 && point.offset == 0) {
      floats.push_back(*number);
    }
    const double size = std::abs(*number);
    if (size == 0 || (size >= kLeastMeasured && size <= kMostMeasured)) continue;
    ++absurd;
    if (first.empty()) first = fmt::format("{}: {:.3g}", point.name, *number);
  }
  if (absurd == 0) return {};
  const std::string order = OrderOf(*record.device, floats);
  return {fmt::format(
      "{} of {} numbers cannot be true ({}{}): {}", absurd, numbers, first,
      absurd > 1 ? ", ..." : "",
      order.empty() ? "check the order of their bytes (order), their type and their register"
                    : "their bytes come in another order: set order: " + order + " at the device")};
}

}  // namespace baudgate::control
