// SPDX-License-Identifier: Apache-2.0
#include "protocols/spabus/clock_messages.h"

#include <fmt/format.h>

#include <ctime>

namespace baudgate::protocols::spabus {
namespace {

using std::chrono::duration_cast;
using std::chrono::floor;
using std::chrono::milliseconds;
using std::chrono::seconds;

bool IsDue(const std::optional<Instant>& sent, Duration period, Instant now) {
  return period > Duration::zero() && (!sent || now - *sent >= period);
}

/// What the clock on the wall shows.
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

}  // namespace baudgate::protocols::spabus
