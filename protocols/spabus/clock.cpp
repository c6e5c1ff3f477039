// SPDX-License-Identifier: Apache-2.0
#include "protocols/spabus/clock.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <ctime>

#include "gateway/base/text.h"

namespace baudgate::protocols::spabus {
namespace {

using std::chrono::duration_cast;
using std::chrono::floor;
using std::chrono::milliseconds;
using std::chrono::seconds;

bool IsDue(const std::optional<Instant>& sent, Duration period, Instant now) {
  return period > Duration::zero() && (!sent || now - *sent >= period);
}

std::tm CivilTime(std::time_t time, Zone zone) {
  std::tm civil{};
  if (zone == Zone::utc) {
    gmtime_r(&time, &civil);
    return civil;
  }
  localtime_r(&time, &civil);
  if (zone == Zone::local || civil.tm_isdst <= 0) return civil;
  constexpr std::time_t kSummerTime = 3600;
  const std::time_t standard = time + civil.tm_gmtoff - kSummerTime;
  gmtime_r(&standard, &civil);
  return civil;
}

}  // namespace

void ClockMessages::OnHostClock(bool right) {
  if (right && !right_) {
    seconds_sent_.reset();
    date_sent_.reset();
  }
  right_ = right;
}

std::optional<char> ClockMessages::Due(const ClockSettings& settings, Instant now) const {
  if (!right_) return std::nullopt;
  if (IsDue(date_sent_, settings.date, now)) return kDate;
  if (IsDue(seconds_sent_, settings.seconds, now)) return kSeconds;
  return std::nullopt;
}

void ClockMessages::OnSent(char item, Instant now) {
  (item == kDate ? date_sent_ : seconds_sent_) = now;
}

std::string ClockText(char item, WallTime time, Zone zone) {
  const auto whole = floor<seconds>(time);
  const auto rest = duration_cast<milliseconds>(time - whole).count();
  const std::tm civil = CivilTime(whole.time_since_epoch().count(), zone);
  const std::string second = fmt::format("{:02}.{:03}", civil.tm_sec, rest);
  if (item == kSeconds) return second;
  return fmt::format("{:02}-{:02}-{:02} {:02}.{:02};{}", civil.tm_year % 100, civil.tm_mon + 1,
                     civil.tm_mday, civil.tm_hour, civil.tm_min, second);
}

std::optional<Duration> SecondsOf(std::string_view data) {
  constexpr double kMinute = 60;
  constexpr double kNanos = 1e9;
  const auto seconds = ParseDecimal(Trim(data));
  if (!seconds || !(*seconds >= 0 && *seconds < kMinute)) return std::nullopt;
  return Duration(std::llround(*seconds * kNanos));
}

void ClockOffset::OnSent(Now arrives, Duration character) {
  if (!first_) first_ = arrives.instant;
  arrives_ = arrives;
  character_ = character;
}

ClockOffset::Offset ClockOffset::Of(std::string_view data, std::size_t characters, Instant now,
                                    bool right) const {
  constexpr Duration kHalf = 30s;
  const auto said = SecondsOf(data);
  if (!said) return {{}, Quality::bad_configuration};
  if (!first_) return {{}, Quality::bad_waiting};
  const Duration reply = static_cast<std::int64_t>(characters) * character_;
  const Instant began = std::max(now - reply, arrives_.instant);
  const WallTime looked = arrives_.wall + (began - arrives_.instant) / 2;
  Duration offset = (*said - looked.time_since_epoch() % Duration(1min)) % Duration(1min);
  if (offset > kHalf) offset -= 1min;
  if (offset <= -kHalf) offset += 1min;
  const bool narrow = began - *first_ <= kWidest;
  return {std::chrono::duration<double>(offset).count(),
          right && narrow ? Quality::good : Quality::uncertain_sub_normal};
}

}  // namespace baudgate::protocols::spabus
