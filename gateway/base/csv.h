// Tables for spreadsheets.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <string_view>

namespace baudgate {

/// Spreadsheets take such a cell for a formula. "-5.2 kW" is none, and "-" neither.
inline bool LooksLikeFormula(std::string_view text) {
  if (text.empty()) return false;
  if (std::string_view("=@\t\r").find(text.front()) != std::string_view::npos) return true;
  if (text.front() != '+' && text.front() != '-') return false;
  const std::string_view rest = text.substr(1);
  return !rest.empty() &&
         (std::string_view("0123456789., ").find(rest.front()) == std::string_view::npos ||
          rest.find_first_of("=+-*/^&|!()@<>:;\"'") != std::string_view::npos);
}

/// One cell as RFC 4180 has it, for programs: nothing is changed.
inline std::string PlainCsvCell(std::string_view text) {
  if (text.find_first_of(",\"\r\n") == std::string_view::npos) return std::string(text);
  std::string quoted = "\"";
  for (const char c : text) quoted += c == '"' ? std::string("\"\"") : std::string(1, c);
  return quoted + "\"";
}

/// The same for people's spreadsheets: no formula. Not for numbers.
inline std::string CsvCell(std::string text) {
  if (LooksLikeFormula(text)) text.insert(0, "'");
  return PlainCsvCell(text);
}

}  // namespace baudgate
