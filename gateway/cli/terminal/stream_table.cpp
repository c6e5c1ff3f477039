// SPDX-License-Identifier: Apache-2.0
#include "gateway/cli/terminal/stream_table.h"

#include <algorithm>
#include <utility>

#include "gateway/cli/terminal/width.h"

namespace baudgate {

StreamTable::StreamTable(std::vector<Column> columns) : columns_(std::move(columns)) {
  for (Column& column : columns_) column.width = std::max(column.width, WidthOf(column.title));
}

void StreamTable::Print(const std::vector<Row>& rows, std::ostream& out) {
  bool grown = false;
  for (const Row& row : rows) {
    for (std::size_t i = 0; i + 1 < columns_.size(); ++i) {
      if (WidthOf(row[i]) <= columns_[i].width) continue;
      columns_[i].width = WidthOf(row[i]);
      grown = true;
    }
  }
  if (!rows.empty() && (grown || !headed_)) {
    Row titles;
    for (const Column& column : columns_) titles.push_back(column.title);
    PrintRow(titles, out);
    headed_ = true;
  }
  for (const Row& row : rows) PrintRow(row, out);
}

void StreamTable::PrintRow(const Row& row, std::ostream& out) const {
  std::string line;
  for (std::size_t i = 0; i + 1 < columns_.size(); ++i) {
    line += row[i] + std::string(columns_[i].width - WidthOf(row[i]) + 2, ' ');
  }
  line += row.back();
  line.erase(line.find_last_not_of(' ') + 1);
  out << line << '\n';
}

}  // namespace baudgate
