// SPDX-License-Identifier: Apache-2.0
#include "protocols/set4tm/civil_bcd.h"

#include <array>

namespace baudgate::protocols::set4tm {
namespace {

std::optional<unsigned> FromBcd(std::uint8_t byte) {
  if ((byte & 0x0FU) > 9 || byte >> 4U > 9) return std::nullopt;
  return (byte >> 4U) * 10U + (byte & 0x0FU);
}

template <typename T>
std::uint8_t ToBcd(T value) {
  const auto number = static_cast<unsigned>(value);
  return static_cast<std::uint8_t>(number / 10 << 4U | number % 10);
}

}  // namespace

std::optional<CivilZone::Civil> CivilOf(View bytes) {
  std::array<unsigned, kCivilSize> parts{};
  if (bytes.size() != kCivilSize) return std::nullopt;
  for (std::size_t i = 0; i < kCivilSize; ++i) {
    const auto two = FromBcd(bytes[i]);
    if (!two) return std::nullopt;
    parts[i] = *two;
  }
  const std::chrono::year_month_day date{std::chrono::year(static_cast<int>(2000 + parts[6])),
                                         std::chrono::month(parts[5]), std::chrono::day(parts[4])};
  if (!date.ok() || parts[0] > 59 || parts[1] > 59 || parts[2] > 23) return std::nullopt;
  return std::chrono::local_days(date) + std::chrono::hours(parts[2]) +
         std::chrono::minutes(parts[1]) + std::chrono::seconds(parts[0]);
}

Bytes BytesOf(CivilZone::Civil civil) {
  const auto day = std::chrono::floor<std::chrono::days>(civil);
  const std::chrono::year_month_day date(day);
  const std::chrono::hh_mm_ss clock(civil - day);
  return {ToBcd(clock.seconds().count()),
          ToBcd(clock.minutes().count()),
          ToBcd(clock.hours().count()),
          static_cast<std::uint8_t>(std::chrono::weekday(day).iso_encoding()),
          ToBcd(unsigned{date.day()}),
          ToBcd(unsigned{date.month()}),
          ToBcd(int{date.year()} % 100)};
}

}  // namespace baudgate::protocols::set4tm
