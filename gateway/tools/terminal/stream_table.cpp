// SPDX-License-Identifier: Apache-2.0
#include "gateway/tools/terminal/stream_table.h"

#include <algorithm>
#include <limits>
#include <utility>

#include "gateway/tools/terminal/column_layout.h"
#include "gateway/tools/terminal/width.h"

namespace baudgate {

StreamTable::StreamTable(std::vector<Column> columns, std::size_t limit)
    : columns_(std::move(columns)), limit_(limit) {
  for (Column& column : columns_) {
    column.width = std::max(limit_ > 0 ? 0 : column.width, WidthOf(column.title));
  }
}

bool StreamTable::Grow(const std::vector<Row>& rows) {
  bool grown = false;
  for (const Row& row : rows) {
    for (std::size_t i = 0; i + 1 < columns_.size(); ++i) {
      if (WidthOf(row[i]) <= columns_[i].width) continue;
      columns_[i].width = WidthOf(row[i]);
      grown = true;
    }
  }
  return grown;
}

void StreamTable::Print(const std::vector<Row>& rows, std::ostream& out) {
  const bool grown = Grow(rows);
  std::vector<ColumnShape> shapes;
  Row titles;
  for (const Column& column : columns_) {
    shapes.push_back({column.width, column.right});
    titles.push_back(column.title);
  }
  constexpr std::size_t kAsLongAsItLikes = std::numeric_limits<std::size_t>::max() / 2;
  if (!shapes.back().right) shapes.back().width = kAsLongAsItLikes;
  const ColumnLayout layout(std::move(shapes), limit_);
  if (!rows.empty() && (grown || !headed_)) {
    out << layout.Row(titles);
    headed_ = true;
  }
  for (const Row& row : rows) out << layout.Row(row);
}

}  // namespace baudgate
