// An aligned table whose rows come by and by. Columns only grow; when one does behind the header,
// the header is printed again above the rows that need it:
//
//   point                 outcome
//   bay-1.feeder-1.group  ok
//   point                         outcome
//   bay-1.feeder-1.setting_group  ok
//
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <ostream>
#include <string>
#include <vector>

namespace baudgate {

class StreamTable {
 public:
  struct Column {
    std::string title;
    std::size_t width = 0;  ///< at first; never less than the title
  };
  using Row = std::vector<std::string>;

  explicit StreamTable(std::vector<Column> columns);

  /// Each row has as many cells as there are columns; the last is as long as it likes.
  void Print(const std::vector<Row>& rows, std::ostream& out);

 private:
  void PrintRow(const Row& row, std::ostream& out) const;

  std::vector<Column> columns_;
  bool headed_ = false;
};

}  // namespace baudgate
