// A table as spreadsheets export it: separated by commas, semicolons or tabs, with quotes where a
// cell holds a separator.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <string_view>
#include <vector>

namespace baudgate {

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

}  // namespace baudgate
