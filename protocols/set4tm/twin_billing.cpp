// SPDX-License-Identifier: Apache-2.0
#include "protocols/set4tm/twin_billing.h"

#include "protocols/set4tm/codec.h"

namespace baudgate::protocols::set4tm {
namespace {

using std::chrono::local_days;
using std::chrono::months;
using std::chrono::year_month_day;

/// The latest such month that has begun.
std::optional<local_days> MonthOf(unsigned month, year_month_day today) {
  const year_month_day first = today.year() / std::chrono::month(month) / 1;
  if (!first.ok()) return std::nullopt;
  return local_days(std::chrono::month(month) > today.month() ? first - std::chrono::years(1)
                                                              : first);
}

std::optional<local_days> DayOf(unsigned day, year_month_day today) {
  if (day < 1 || day > 31) return std::nullopt;
  year_month_day date = today.year() / today.month() / std::chrono::day(day);
  while (!date.ok() || local_days(date) > local_days(today)) date -= months(1);
  return local_days(date);
}

}  // namespace

std::array<std::uint32_t, 4> TwinCounts(std::chrono::local_days begin, unsigned tariff) {
  const auto day = static_cast<std::uint32_t>(begin.time_since_epoch().count());
  const std::uint32_t base = day * 1000 + tariff * 100;
  return {base + 1, base + 2, base + 3, base + 4};
}

std::optional<Bytes> TwinRegisters(View pdu, CivilZone::Civil now) {
  constexpr std::uint8_t kAllEnergies = 0x0F;
  constexpr unsigned kTariffs = 8;
  if (pdu.size() != 6 || pdu[0] != kEnergyExtended || pdu[4] != kAllEnergies || pdu[3] > kTariffs) {
    return std::nullopt;
  }
  const year_month_day today(std::chrono::floor<std::chrono::days>(now));
  std::optional<local_days> begin;
  if (pdu[1] == 0x83) begin = MonthOf(pdu[2], today);
  if (pdu[1] == 0x84) begin = local_days(today);
  if (pdu[1] == 0x86) begin = DayOf(pdu[2], today);
  if (!begin) return std::nullopt;
  Bytes data;
  for (const std::uint32_t count : TwinCounts(*begin, pdu[3])) {
    for (unsigned shift = 32; shift > 0; shift -= 8) {
      data.push_back(static_cast<std::uint8_t>(count >> (shift - 8)));
    }
  }
  return data;
}

}  // namespace baudgate::protocols::set4tm
