// Formats values, ages and foreign text for people, in tables and sentences.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <charconv>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <system_error>

#include "gateway/base/time.h"

namespace baudgate {

/// Formats a whole number below 1e15 with all its digits, and other numbers with at most nine
/// digits: "1834523", "12.25"; "-" for NaN.
std::string FormatValue(double value);
/// Formats a number with this many digits after the decimal point. Without `decimals`: with four
/// significant digits, but with all digits before the point: "0.5235", "12.25", "400.0", "123457".
/// Zeros at the end stay, so that the width of a changing value stays. Numbers from 1e15 on, and
/// without `decimals` those below 1e-4, have an exponent. An empty text for NaN and infinities.
std::string ShownNumber(double value, std::optional<int> decimals = {});
/// Returns "0.3 s", "12 s", "5 min", "3 h", "2 d".
std::string FormatAge(Duration age);
/// Returns "1 line", "2 lines".
std::string Plural(std::uint64_t count, std::string_view word);
/// Replaces each control character that is not in `kept`, and each byte that is not UTF-8, by '?'.
std::string Harmless(std::string_view text, std::string_view kept = {});

/// True for numbers such as "-5.25" and "1e-05".
inline bool LooksLikeNumber(std::string_view text) {
  if (text.starts_with('+') || text.starts_with('-')) text.remove_prefix(1);
  if (text.empty() ||
      std::string_view("0123456789.").find(text.front()) == std::string_view::npos) {
    return false;
  }
  double number = 0;
  const char* const end = text.data() + text.size();
  const auto read = std::from_chars(text.data(), end, number);
  return read.ptr == end && read.ec != std::errc::invalid_argument;
}

/// True if a spreadsheet would take the text of a cell for a formula. "-5.2 kW" and "-" are not
/// formulas.
inline bool LooksLikeFormula(std::string_view text) {
  if (text.empty() || LooksLikeNumber(text)) return false;
  if (std::string_view("=@\t\r\n").find(text.front()) != std::string_view::npos) return true;
  if (text.front() != '+' && text.front() != '-') return false;
  const std::string_view rest = text.substr(1);
  return !rest.empty() &&
         (std::string_view("0123456789., ").find(rest.front()) == std::string_view::npos ||
          rest.find_first_of("=+-*/^&|!()@<>:;\"'") != std::string_view::npos);
}

/// Quotes a cell by RFC 4180. If the text looks like a formula, a ' before it makes spreadsheets
/// show it as text.
inline std::string CsvCell(std::string text) {
  if (LooksLikeFormula(text)) text.insert(0, "'");
  if (text.find_first_of(",\"\r\n") == std::string::npos) return text;
  std::string quoted = "\"";
  for (const char c : text) quoted += c == '"' ? std::string("\"\"") : std::string(1, c);
  return quoted + "\"";
}

/// Returns one row with its line end. Every CSV output of the program must use this function.
inline std::string CsvLine(std::span<const std::string> cells) {
  std::string line;
  for (std::size_t i = 0; i < cells.size(); ++i) line += (i == 0 ? "" : ",") + CsvCell(cells[i]);
  return line + "\r\n";
}

}  // namespace baudgate
