// SPDX-License-Identifier: Apache-2.0
#include "gateway/base/shown.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "gateway/base/decimal.h"
#include "gateway/base/text.h"

namespace baudgate {
namespace {

std::string WithUnit(double amount, std::string_view unit) {
  char buffer[32];
  const int digits = amount < 10 && unit == "s" ? 1 : 0;
  const auto end =
      std::to_chars(buffer, buffer + sizeof buffer, amount, std::chars_format::fixed, digits).ptr;
  return std::string(buffer, end).append(" ").append(unit);
}

}  // namespace

std::string Plural(std::uint64_t count, std::string_view word) {
  return std::to_string(count) + " " + std::string(word) + (count == 1 ? "" : "s");
}

std::string Harmless(std::string_view text, std::string_view kept) {
  std::string safe(text);
  for (char& c : safe) {
    const auto byte = static_cast<unsigned char>(c);
    const bool control = byte < 0x20 || byte == 0x7F;
    if (control && kept.find(c) == std::string_view::npos) c = '?';
  }
  // C1 control characters (U+0080…U+009F, two bytes in UTF-8) control some terminals.
  for (std::size_t at = 0; at + 1 < safe.size(); ++at) {
    const auto next = static_cast<unsigned char>(safe[at + 1]);
    if (safe[at] == '\xC2' && next >= 0x80 && next < 0xA0) {
      safe[at] = '?';
      safe.erase(at + 1, 1);
    }
  }
  for (auto at = FirstNotUtf8(safe); at != std::string::npos; at = FirstNotUtf8(safe, at + 1)) {
    safe[at] = '?';
  }
  return safe;
}

std::string FormatValue(double value) {
  if (std::isnan(value)) return "-";
  constexpr double kMostWhole = 1e15;
  const bool whole = std::trunc(value) == value && std::abs(value) < kMostWhole;
  char buffer[64];
  const auto end = std::to_chars(buffer, buffer + sizeof buffer, value, std::chars_format::general,
                                 whole ? 15 : 9)
                       .ptr;
  double shown = 0;
  std::from_chars(buffer, end, shown);
  if (std::abs(value) > std::numeric_limits<float>::max()) return std::string(buffer, end);
  const auto single = static_cast<float>(value);
  if (shown == value || static_cast<double>(single) != value) return std::string(buffer, end);
  return std::string(buffer, std::to_chars(buffer, buffer + sizeof buffer, single).ptr);
}

namespace {

std::string Written(double value, std::chars_format form, int digits) {
  char buffer[64];
  return std::string(buffer,
                     std::to_chars(buffer, buffer + sizeof buffer, value, form, digits).ptr);
}

/// Formats a number with this many decimals. Rounds halves of the decimal number that the double or
/// float32 stands for away from zero: 0.35 with one decimal is 0.4.
std::string Rounded(double value, int decimals) {
  const auto whole = Decimal(AsDecimal(value)).Shifted(decimals).ToInt64();
  if (!whole) return Written(value, std::chars_format::fixed, decimals);
  std::string text = std::to_string(*whole);
  const std::size_t sign = *whole < 0 ? 1 : 0;
  const auto behind = static_cast<std::size_t>(decimals);
  if (text.size() - sign <= behind) text.insert(sign, behind + 1 - (text.size() - sign), '0');
  if (behind > 0) text.insert(text.size() - behind, ".");
  return text;
}

}  // namespace

std::string ShownNumber(double value, std::optional<int> decimals) {
  if (!std::isfinite(value)) return {};
  constexpr int kDigits = 4;
  constexpr double kMostPlain = 1e15;
  const std::string scientific = Written(value, std::chars_format::scientific, kDigits - 1);
  if (std::abs(value) >= kMostPlain) return scientific;
  const bool four_digits = !decimals;
  if (four_digits) {
    // The exponent of the rounded number: 9.9996 is 1.000e+01.
    int exponent = 0;
    const char* const end = scientific.data() + scientific.size();
    const char* digits = scientific.data() + scientific.find('e') + 1;
    std::from_chars(*digits == '+' ? digits + 1 : digits, end, exponent);
    if (exponent < -kDigits) return scientific;
    decimals = std::max(0, kDigits - 1 - exponent);
  }
  std::string text = Rounded(value, *decimals);
  // The double 9.9995 is a little less, so its exponent is 0; but 9.9995 is shown as 10.00.
  const std::size_t first = text.find_first_of("123456789");
  const bool carried = four_digits && *decimals > 0 && first != std::string::npos &&
                       std::count_if(text.begin() + static_cast<std::ptrdiff_t>(first), text.end(),
                                     [](char c) { return c != '.'; }) > kDigits;
  if (carried) text = Rounded(value, *decimals - 1);
  const bool is_zero = text.find_first_of("123456789") == std::string::npos;
  if (is_zero && text.starts_with('-')) text.erase(0, 1);
  return text;
}

std::string FormatAge(Duration age) {
  const double seconds = std::max(0.0, std::chrono::duration<double>(age).count());
  if (seconds < 99.5) return WithUnit(seconds, "s");
  if (seconds < 99.5 * 60) return WithUnit(seconds / 60, "min");
  if (seconds < 48 * 3600) return WithUnit(seconds / 3600, "h");
  return WithUnit(seconds / 86400, "d");
}

}  // namespace baudgate
