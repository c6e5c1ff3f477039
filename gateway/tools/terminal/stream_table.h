// An aligned table whose rows come by and by. Columns only grow; when one does behind the header,
// the header is printed again above the rows that need it:
//
//   point                 outcome
//   bay-1.feeder-1.group  ok
//   point                         outcome
//   bay-1.feeder-1.setting_group  ok
//
// In a terminal rows that are too wide are folded (column_layout.h).
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <ostream>
#include <string>
#include <vector>

namespace baudgate {

class StreamTable {
 public:
  struct Column {
    std::string title{};
    std::size_t width = 0;  ///< at first, where lines have no limit; never less than the title
    bool right = false;     ///< numbers
  };
  using Row = std::vector<std::string>;

  /// `limit`: characters a line; 0: no limit.
  explicit StreamTable(std::vector<Column> columns, std::size_t limit = 0);

  /// Each row has as many cells as there are columns; the last is as long as it likes.
  void Print(const std::vector<Row>& rows, std::ostream& out);

 private:
  bool Grow(const std::vector<Row>& rows);

  std::vector<Column> columns_;
  const std::size_t limit_;
  bool headed_ = false;
};

}  // namespace baudgate
