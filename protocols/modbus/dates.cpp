// Layout of the four registers of a time by IEC 60870-5-4 (TI081), highest bit first:
//
//   0000 0000 0YYY YYYY   year since 2000
//   0000 MMMM wwwD DDDD   month, weekday, day
//   S00h hhhh V0mm mmmm   S: summer time, hour, V: invalid or not synchronised, minute
//   milliseconds          0…59999, seconds included
//
#include "protocols/modbus/dates.h"

#include <algorithm>
#include <array>
#include <chrono>
#include <cstdio>
#include <limits>

#include "gateway/base/text.h"

namespace baudgate::protocols::modbus {
namespace {

using Words = std::vector<std::uint16_t>;
/// Year, month, day, hour, minute, second.
using Parts = std::array<unsigned, 6>;

struct DateRow {
  std::string_view name;
  DateForm form;
  std::size_t registers;
};

constexpr DateRow kDateForms[] = {{"unix", DateForm::unix, 2},
                                  {"ti081", DateForm::ti081, 4},
                                  {"registers", DateForm::registers, 6},
                                  {"bytes", DateForm::bytes, 3},
                                  {"bcd", DateForm::bcd, 3}};

std::chrono::year_month_day DayOf(const Parts& parts) {
  return std::chrono::year(static_cast<int>(parts[0])) / std::chrono::month(parts[1]) /
         std::chrono::day(parts[2]);
}

bool IsDate(const Parts& parts) {
  return DayOf(parts).ok() && parts[3] < 24 && parts[4] < 60 && parts[5] < 60;
}

Parts OfSeconds(std::uint32_t seconds) {
  const std::chrono::sys_seconds at{std::chrono::seconds(seconds)};
  const auto day = std::chrono::floor<std::chrono::days>(at);
  const std::chrono::year_month_day date(day);
  const std::chrono::hh_mm_ss time(at - day);
  return {static_cast<unsigned>(static_cast<int>(date.year())),
          static_cast<unsigned>(date.month()),
          static_cast<unsigned>(date.day()),
          static_cast<unsigned>(time.hours().count()),
          static_cast<unsigned>(time.minutes().count()),
          static_cast<unsigned>(time.seconds().count())};
}

/// Converts a byte with two decimal digits (BCD). Empty: a digit is above 9.
std::optional<unsigned> OfBcd(unsigned byte) {
  if ((byte & 0xFU) > 9 || byte >> 4U > 9) return std::nullopt;
  return 10 * (byte >> 4U) + (byte & 0xFU);
}

std::optional<Parts> PartsOf(DateForm form, const Words& words) {
  Parts parts{};
  switch (form) {
    case DateForm::unix:
      return OfSeconds((std::uint32_t{words[0]} << 16U) | words[1]);
    case DateForm::ti081:
      return Parts{2000 + (words[0] & 0x7FU), (words[1] >> 8U) & 0xFU, words[1] & 0x1FU,
                   (words[2] >> 8U) & 0x1FU,  words[2] & 0x3FU,        words[3] / 1000U};
    case DateForm::registers:
      std::ranges::copy(words, parts.begin());
      break;
    case DateForm::bytes:
    case DateForm::bcd:
      for (std::size_t i = 0; i < parts.size(); ++i) {
        const unsigned byte = i % 2 == 0 ? words[i / 2] >> 8U : words[i / 2] & 0xFFU;
        const auto part = form == DateForm::bcd ? OfBcd(byte) : std::optional(byte);
        if (!part) return std::nullopt;
        parts[i] = *part;
      }
      break;
  }
  if (parts[0] < 100) parts[0] += 2000;
  return parts;
}

}  // namespace

std::optional<DateForm> DateFormNamed(std::string_view name) {
  const auto* const row = std::ranges::find(kDateForms, name, &DateRow::name);
  return row == std::end(kDateForms) ? std::nullopt : std::optional(row->form);
}

std::size_t RegistersOf(DateForm form) {
  return std::ranges::find(kDateForms, form, &DateRow::form)->registers;
}

Decoded DecodeDate(DateForm form, const Words& words) {
  const auto parts = PartsOf(form, words);
  if (!parts || !IsDate(*parts)) return {{}, Quality::bad_device_failure};
  char text[32];
  std::snprintf(text, sizeof text, "%04u-%02u-%02u %02u:%02u:%02u", (*parts)[0], (*parts)[1],
                (*parts)[2], (*parts)[3], (*parts)[4], (*parts)[5]);
  const bool doubted = form == DateForm::ti081 && (words[2] & 0x80U) != 0;
  return {std::string(text), doubted ? Quality::uncertain : Quality::good};
}

std::optional<Words> EncodeDate(DateForm form, std::string_view text) {
  Parts parts{};
  constexpr std::size_t kStarts[] = {0, 5, 8, 11, 14, 17};
  for (std::size_t i = 0; i < parts.size(); ++i) {
    if (text.size() < 19) return std::nullopt;
    const auto part = ParseInteger<unsigned>(text.substr(kStarts[i], i == 0 ? 4 : 2));
    if (!part) return std::nullopt;
    parts[i] = *part;
  }
  if (!IsDate(parts) || parts[0] < 1970) return std::nullopt;
  const auto word = [](unsigned value) { return static_cast<std::uint16_t>(value & 0xFFFFU); };
  if (form == DateForm::registers) return Words(parts.begin(), parts.end());
  if (form == DateForm::unix) {
    const auto days = std::chrono::sys_days(DayOf(parts)).time_since_epoch().count();
    const long long all = days * 86'400LL + parts[3] * 3600LL + parts[4] * 60LL + parts[5];
    if (all > std::numeric_limits<std::uint32_t>::max()) return std::nullopt;  // after 2106-02-07
    const auto seconds = static_cast<std::uint32_t>(all);
    return Words{word(seconds >> 16U), word(seconds)};
  }
  // These forms have the year since 2000: seven bits, or two digits.
  const unsigned last = form == DateForm::ti081 ? 2127 : 2099;
  if (parts[0] < 2000 || parts[0] > last) return std::nullopt;
  const unsigned year = parts[0] - 2000;
  if (form == DateForm::ti081) {
    return Words{word(year), word(parts[1] << 8U | parts[2]), word(parts[3] << 8U | parts[4]),
                 word(parts[5] * 1000)};
  }
  parts[0] = year;
  Words words;
  for (std::size_t i = 0; i < parts.size(); i += 2) {
    const auto byte = [&](unsigned part) {
      return form == DateForm::bcd ? (part / 10) << 4U | part % 10 : part;
    };
    words.push_back(word(byte(parts[i]) << 8U | byte(parts[i + 1])));
  }
  return words;
}

}  // namespace baudgate::protocols::modbus
