// `baudgate profiles --new FROM.csv`: a profile from a device's register list. ListedExample is the
// example of a list, as the twin shows it, and ReadCsv reads the table of a spreadsheet.
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

// The words of register lists: what their columns, types, tables and permissions are called.

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

// The example of a register list, as the twin of the device shows it.

/// "0.1", "0,1", "1E-05".
std::optional<Decimal> ListedNumber(const std::string& text);

/// The raw value behind `simulate:`, as YAML has it: "2304" of "230,4" at a scale of 0.1,
/// 1795737600 of "2026-11-27" where the form is DATE. `form`: what the registers hold. The error
/// says why they cannot hold it.
Result<std::string> ListedExample(const std::string& text, const std::string& form,
                                  const Decimal& scale);

struct NewProfileOptions {
  std::string file;
  std::optional<FirstRegister> first{};
  std::string table = "holding";  ///< of numbers that tell none
  std::string title{};            ///< `device:`; empty: the file's name
};

/// The profile goes to `out`, or nothing does. Exit codes: 0 done, 2 it is not said what the first
/// register is called, 3 the list has errors (all go to `err`), 4 it cannot be read.
int RunNewProfile(const NewProfileOptions& options, const config::Catalog& catalog,
                  std::ostream& out, std::ostream& err);

}  // namespace baudgate::tools
