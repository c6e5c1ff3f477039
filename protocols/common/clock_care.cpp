// SPDX-License-Identifier: Apache-2.0
#include "protocols/common/clock_care.h"

#include <algorithm>

namespace baudgate {
namespace {

using std::chrono::days;
using std::chrono::floor;
using std::chrono::minutes;
using std::chrono::seconds;

constexpr minutes kHalfHour{30};
constexpr minutes kFromBorder{5};
constexpr minutes kFromMidnight{30};

std::optional<std::uint32_t> PointOf(const config::Device& device, std::string_view name) {
  const auto found = std::ranges::find(device.points, name, &config::Point::name);
  if (found == device.points.end()) return std::nullopt;
  return static_cast<std::uint32_t>(found - device.points.begin());
}

}  // namespace

std::optional<ClockCare> ClockCareOf(const config::Device& device) {
  if (!device.options.Has(kCorrectClock)) return std::nullopt;
  ClockCare care;
  care.least = device.options.Time(kCorrectClock);
  if (care.least <= Duration::zero()) return std::nullopt;
  care.most = device.options.Time(kCorrectClockMost);
  const auto zone = CivilZone::Parse(device.options.Text("time_zone"));
  const auto drift = PointOf(device, kClockDriftPoint);
  const auto correction = PointOf(device, kClockCorrectionPoint);
  if (!zone || !drift || !correction) return std::nullopt;
  care.zone = *zone;
  care.drift = *drift;
  care.correction = *correction;
  return care;
}

bool MayCorrectAt(WallTime now, const CivilZone& zone) {
  const auto civil = zone.ToCivil(floor<seconds>(now));
  const auto of_day = civil - floor<days>(civil);
  const auto of_half = of_day % kHalfHour;
  if (of_half < kFromBorder || of_half >= kHalfHour - kFromBorder) return false;
  return of_day >= kFromMidnight && of_day < days(1) - kFromMidnight;
}

}  // namespace baudgate
