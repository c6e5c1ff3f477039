// The words of register lists: what their columns, types, tables and permissions are called.
// ReadCsv reads the table of a spreadsheet.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace baudgate {

// A table as spreadsheets export it: separated by commas, semicolons or tabs, with quotes where a
// cell holds a separator.
struct CsvRow {
  int line = 0;  ///< of the file, from 1 on
  std::vector<std::string> cells;
};

struct CsvTable {
  char separator = ',';
  std::vector<CsvRow> rows;  ///< without empty ones; the first is the header
};

/// The separator is the one that the first row has most of; Excel's first line "sep=;" names it.
/// Blanks around cells are dropped.
CsvTable ReadCsv(std::string_view text);

enum class ListColumn {
  name,
  address,
  type,
  unit,
  scale,
  access,
  table,
  group,
  description,
  example,
  order
};

/// "Data Type" → type. Case, blanks and marks do not count.
std::optional<ListColumn> ColumnNamed(std::string_view header);

/// "U16", "WORD", "unsigned int 16" → "uint16"; "STRING(16)", "char[16]" → "string(16)", and
/// "string" if no length stands there; "Date" → "DATE".
std::optional<std::string> FormNamed(std::string_view text);

/// "Holding Register", "FC3", "4x" → "holding".
std::optional<std::string> TableNamed(std::string_view text);

/// "R/W", "read-write" → "rw".
std::optional<std::string> AccessNamed(std::string_view text);

/// "low word first", "word swap" → "CDAB". Empty: "little endian" too, which means CDAB to some
/// manuals and DCBA to others.
std::optional<std::string> OrderNamed(std::string_view text);

/// How many registers a form takes; 1 of bits.
std::size_t RegistersOf(const std::string& form);
/// Characters of "string(16)".
std::size_t LengthOf(const std::string& form);
/// Two registers with a time or a date of IEC 61131-3.
bool IsTimeForm(std::string_view form);

/// As a text stands in YAML.
std::string InQuotes(std::string_view text);

}  // namespace baudgate
