// Aligned columns for people, Markdown tables for docs, CSV for spreadsheets: one table, three
// forms. Cells come from gateway/tools/cli; text goes to its streams.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <ostream>
#include <string>
#include <vector>

namespace baudgate::config {

class TextTable {
 public:
  explicit TextTable(std::vector<std::string> header) : header_(std::move(header)) {}

  /// As many cells as the header has.
  void Add(std::vector<std::string> row) { rows_.push_back(std::move(row)); }
  bool empty() const { return rows_.empty(); }

  /// Columns two blanks apart; columns without any content are left out. Rows that are wider than
  /// `limit` characters (0: none) are folded (column_layout.h).
  void PrintAligned(std::ostream& out, const std::string& indent = "", std::size_t limit = 0) const;
  void PrintMarkdown(std::ostream& out) const;
  /// RFC 4180, with a header.
  void PrintCsv(std::ostream& out) const;

 private:
  std::vector<std::string> header_;
  std::vector<std::vector<std::string>> rows_;
};

}  // namespace baudgate::config
