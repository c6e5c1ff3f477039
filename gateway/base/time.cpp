// SPDX-License-Identifier: Apache-2.0
#include "gateway/base/time.h"

#include <array>
#include <charconv>
#include <cmath>
#include <cstdio>
#include <utility>

#include "gateway/base/decimal.h"
#include "gateway/base/text.h"

namespace baudgate {
namespace {

struct Unit {
  std::string_view name;
  Duration length;
};

// The longest unit comes first, so that FormatDuration takes the largest unit that gives a short
// number.
constexpr std::array<Unit, 6> kUnits = {
    {{"d", 24h}, {"h", 1h}, {"min", 1min}, {"s", 1s}, {"ms", 1ms}, {"us", 1us}}};

/// Formats without an exponent, because ParseDuration refuses exponents.
std::string Plain(double value) {
  char buffer[64];
  const auto [end, error] =
      std::to_chars(buffer, buffer + sizeof buffer, value, std::chars_format::fixed);
  return error == std::errc() ? std::string(buffer, end) : std::string();
}

}  // namespace

Now ReadClocks() {
  return {std::chrono::steady_clock::now(),
          std::chrono::time_point_cast<std::chrono::nanoseconds>(std::chrono::system_clock::now())};
}

Result<Duration> ParseDuration(std::string_view text) {
  if (const std::string meant = WithDecimalPoint(text); !meant.empty()) {
    return Error{"'" + std::string(text) + "' has a decimal comma; write " + meant};
  }
  const auto digits = text.find_first_not_of("0123456789.");
  const std::string_view number = text.substr(0, digits);
  const std::string_view unit = digits == std::string_view::npos ? "" : Trim(text.substr(digits));
  const auto value = ParseDecimal(number);
  const std::string shown(text);
  if (!value)
    return Error{"'" + shown + "' is not a duration; write for example 250ms, 1s or 5min"};
  if (unit.empty()) {
    if (*value == 0) return Duration::zero();
    return Error{"'" + shown + "' has no unit; write for example " + shown + "ms or " + shown +
                 "s"};
  }
  for (const Unit& known : kUnits) {
    if (unit != known.name) continue;
    const double length = *value * static_cast<double>(known.length.count());
    if (length > 1e18) return Error{"'" + shown + "' is too long"};
    return Duration(std::llround(length));
  }
  return Error{"'" + shown + "' has an unknown unit; units are us, ms, s, min, h and d"};
}

std::string FormatDuration(Duration duration) {
  if (duration == Duration::zero()) return "0s";
  for (const Unit& unit : kUnits) {
    if (duration < unit.length) continue;
    const double value =
        static_cast<double>(duration.count()) / static_cast<double>(unit.length.count());
    const std::string text = Plain(value);
    if (text.size() <= 6) return text + std::string(unit.name);
  }
  return Plain(static_cast<double>(duration.count()) / 1e3) + "us";
}

std::string FormatWallTime(WallTime time) {
  const auto day = std::chrono::floor<std::chrono::days>(time);
  const std::chrono::year_month_day date(day);
  const std::chrono::hh_mm_ss clock(std::chrono::floor<std::chrono::milliseconds>(time - day));
  char buffer[64];
  std::snprintf(buffer, sizeof buffer, "%04d-%02u-%02uT%02ld:%02ld:%02ld.%03ldZ",
                static_cast<int>(date.year()), static_cast<unsigned>(date.month()),
                static_cast<unsigned>(date.day()), static_cast<long>(clock.hours().count()),
                static_cast<long>(clock.minutes().count()),
                static_cast<long>(clock.seconds().count()),
                static_cast<long>(clock.subseconds().count()));
  return buffer;
}

Result<WallTime> ParseWallTime(std::string_view text) {
  const Error error{"'" + std::string(text) +
                    "' is not a time; write for example 2026-11-21 or 2026-11-21T01:14:31 (UTC); "
                    "years are 1970 to 2200"};
  // Each part: the characters before it, and its number of digits.
  constexpr std::array<std::pair<std::string_view, std::size_t>, 7> kParts = {
      {{"", 4}, {"-", 2}, {"-", 2}, {"T ", 2}, {":", 2}, {":", 2}, {".", 3}}};
  constexpr std::size_t kDate = 3;
  std::array<int, kParts.size()> numbers{};
  std::size_t part = 0;
  if (text.ends_with('Z')) text.remove_suffix(1);
  for (; part < kParts.size() && !text.empty(); ++part) {
    const auto& [before, digits] = kParts[part];
    if (!before.empty() && before.find(text.front()) == std::string_view::npos) return error;
    if (!before.empty()) text.remove_prefix(1);
    if (text.size() < digits) return error;
    const auto [end, failed] = std::from_chars(text.data(), text.data() + digits, numbers[part]);
    if (failed != std::errc() || end != text.data() + digits || numbers[part] < 0) return error;
    text.remove_prefix(digits);
  }
  const auto& [year, month, day, hour, minute, second, millisecond] = numbers;
  const std::chrono::year_month_day date{std::chrono::year(year),
                                         std::chrono::month(static_cast<unsigned>(month)),
                                         std::chrono::day(static_cast<unsigned>(day))};
  const bool whole = part == kDate || part > kDate + 1;  // an hour needs its minutes
  const bool clock = hour < 24 && minute < 60 && second < 60;
  if (!text.empty() || !whole || !clock || !date.ok() || year < 1970 || year > 2200) return error;
  return WallTime(std::chrono::sys_days(date) + std::chrono::hours(hour) +
                  std::chrono::minutes(minute) + std::chrono::seconds(second) +
                  std::chrono::milliseconds(millisecond));
}

Result<WallTime> ParseSince(std::string_view text, WallTime now) {
  const auto span = ParseDuration(text);
  if (span) return now - *span;
  const auto time = ParseWallTime(text);
  if (time) return time;
  // A text such as "1,5h", "99999999d" or "2hours" was meant as a duration, so the error of
  // ParseDuration is returned.
  const auto is = [](char c, char from, char to) { return c >= from && c <= to; };
  const bool was_span = !text.empty() && is(text.front(), '0', '9') && is(text.back(), 'a', 'z');
  if (was_span) return Error{span.error()};
  return Error{"'" + std::string(text) +
               "' is neither a time span, such as 2h, nor a time, such as 2026-11-21T01:14 (UTC)"};
}

}  // namespace baudgate
