// SPDX-License-Identifier: Apache-2.0
#include "protocols/common/clock.h"

#include <algorithm>
#include <string>

#include "gateway/base/text.h"

namespace baudgate::protocols {
namespace {

using std::chrono::hours;
using std::chrono::minutes;

constexpr minutes kMostOffset = hours(14);

CivilZone::Utc LastSunday(std::chrono::year year, std::chrono::month month) {
  return std::chrono::sys_days(year / month / std::chrono::Sunday[std::chrono::last]) + hours(1);
}

}  // namespace

Result<CivilZone> CivilZone::Parse(std::string_view text) {
  const Error error{"\"" + std::string(text) +
                    "\" is not a time zone; write the clock's offset from UTC, for example +03:00, "
                    "or \"+01:00 eu\" if the clock follows European summer time"};
  constexpr std::string_view kDaylight = " eu";
  CivilZone zone;
  zone.daylight_ = text.ends_with(kDaylight);
  if (zone.daylight_) text.remove_suffix(kDaylight.size());
  const bool formed = text.size() == 6 && (text[0] == '+' || text[0] == '-') && text[3] == ':';
  if (!formed) return error;
  const auto hour = ParseInteger<int>(text.substr(1, 2));
  const auto minute = ParseInteger<int>(text.substr(4, 2));
  if (!hour || !minute || *hour < 0 || *minute < 0 || *minute > 59) return error;
  zone.offset_ = hours(*hour) + minutes(*minute);
  if (zone.offset_ > kMostOffset) return error;
  if (text[0] == '-') zone.offset_ = -zone.offset_;
  return zone;
}

bool CivilZone::IsDaylight(Utc utc) const {
  if (!daylight_) return false;
  const auto day = std::chrono::floor<std::chrono::days>(utc);
  const auto year = std::chrono::year_month_day(day).year();
  return utc >= LastSunday(year, std::chrono::March) &&
         utc < LastSunday(year, std::chrono::October);
}

CivilZone::Moment CivilZone::ToUtc(Civil civil) const {
  const Utc winter(civil.time_since_epoch() - offset_);
  const Utc summer = winter - hours(1);
  const bool in_winter = !IsDaylight(winter);
  const bool in_summer = IsDaylight(summer);
  if (in_winter == in_summer) return {winter, in_winter ? Fit::twice : Fit::never};
  return {in_winter ? winter : summer, Fit::once};
}

CivilZone::Civil CivilZone::ToCivil(Utc utc) const {
  return Civil(utc.time_since_epoch() + offset_ + hours(IsDaylight(utc) ? 1 : 0));
}

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

}  // namespace baudgate::protocols
