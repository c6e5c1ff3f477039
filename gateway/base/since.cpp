// SPDX-License-Identifier: Apache-2.0
#include "gateway/base/since.h"

#include <array>
#include <charconv>
#include <string>
#include <utility>

namespace baudgate {

Result<WallTime> ParseWallTime(std::string_view text) {
  const Error error{"'" + std::string(text) +
                    "' is not a time; write for example 2026-11-21 or 2026-11-21T01:14:31 (UTC); "
                    "years are 1970 to 2200"};
  // Each part, and what stands before it.
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
  const bool whole = part == kDate || part > kDate + 1;  // an hour has its minutes
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
  // "1,5h", "99999999d", "2hours"
  const auto is = [](char c, char from, char to) { return c >= from && c <= to; };
  const bool was_span = !text.empty() && is(text.front(), '0', '9') && is(text.back(), 'a', 'z');
  if (was_span) return Error{span.error()};
  return Error{"'" + std::string(text) +
               "' is neither a time span, such as 2h, nor a time, such as 2026-11-21T01:14 (UTC)"};
}

}  // namespace baudgate
