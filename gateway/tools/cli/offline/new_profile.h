// `baudgate profiles --new FROM.csv`: makes a profile from a device's register list.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <ostream>
#include <string>
#include <string_view>
#include <vector>

#include "config/catalog/catalog.h"
#include "gateway/base/decimal.h"
#include "gateway/base/result.h"
#include "gateway/tools/cli/offline/register_list.h"

namespace baudgate::tools {

// A row of a spreadsheet in CSV: cells are separated by commas, semicolons or tabs, and are quoted
// if they contain a separator.
struct CsvRow {
  int line = 0;  ///< line number in the file, from 1 on
  std::vector<std::string> cells;
};

struct CsvTable {
  char separator = ',';
  std::vector<CsvRow> rows;  ///< without empty rows; the first row is the header
};

/// Parses CSV. The separator is that of a first line "sep=;" (Excel), else the most frequent
/// separator in the first row. Blanks around cells are dropped.
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

/// Returns the column with this header. Example: "Data Type" → ListColumn::type. Ignores case,
/// blanks and punctuation.
std::optional<ListColumn> ColumnNamed(std::string_view header);

/// Returns the form (the type of the registers). Examples: "U16", "WORD", "unsigned int 16" →
/// "uint16"; "Date" → "DATE"; "STRING(16)", "char[16]" → "string(16)", or "string" without a
/// length.
std::optional<std::string> FormNamed(std::string_view text);

/// Returns the Modbus table. Examples: "Holding Register", "FC3", "4x" → "holding".
std::optional<std::string> TableNamed(std::string_view text);

/// Returns the access. Examples: "R/W", "read-write" → "rw".
std::optional<std::string> AccessNamed(std::string_view text);

/// Returns the byte order. Examples: "low word first", "word swap" → "CDAB". Returns nothing for
/// "little endian", because it is CDAB in some manuals and DCBA in others.
std::optional<std::string> OrderNamed(std::string_view text);

/// Returns the number of registers of a form (see FormNamed); 1 for bits.
std::size_t RegistersOf(const std::string& form);
/// Returns 16 for the form "string(16)".
std::size_t LengthOf(const std::string& form);
/// True for the times and dates of IEC 61131-3: TIME, DATE, TOD, DT. Each takes two registers.
bool IsTimeForm(std::string_view form);

/// Parses a number as register lists contain it. Examples: "0.1", "0,1", "1E-05".
std::optional<Decimal> ListedNumber(const std::string& text);

/// Returns the raw number in the device as text for `simulate:`. `form`: see FormNamed. Examples:
/// "230,4" with a scale of 0.1 → "2304"; "2026-11-27" with the form DATE → "1795737600".
Result<std::string> ListedExample(const std::string& text, const std::string& form,
                                  const Decimal& scale);

struct NewProfileOptions {
  std::string file;
  std::optional<FirstRegister> first{};
  std::string table = "holding";  ///< table of registers for which the list tells no table
  std::string title{};            ///< text for the profile's `device:`; empty: the file's name
};

/// Prints the profile if the list has no errors. Exit codes: 0 done; 2 `first` is missing; 3 the
/// list has errors, printed on `err`; 4 no such list, or modbus_rtu is not installed.
int RunNewProfile(const NewProfileOptions& options, const config::Catalog& catalog,
                  std::ostream& out, std::ostream& err);

}  // namespace baudgate::tools
