// How the cells of a table stand in a terminal: side by side where they fit its width, else the
// later columns in further lines, indented, and the last one wrapped at words.
//
//   time                      client      point
//       old -> new  outcome   reason that goes
//                             on here
//
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <string>
#include <vector>

namespace baudgate {

struct ColumnShape {
  std::size_t width = 0;  ///< 0: it is left out
  bool right = false;     ///< numbers
};

class ColumnLayout {
 public:
  /// `limit`: characters a line; 0: no limit.
  ColumnLayout(std::vector<ColumnShape> columns, std::size_t limit);

  /// One row, as many cells as columns: its lines, which end in '\n'. Lines without any content are
  /// left out, but for the first.
  std::string Row(const std::vector<std::string>& cells) const;

 private:
  struct Place {
    std::size_t line = 0;
    std::size_t at = 0;  // characters from the left
  };

  const std::vector<ColumnShape> columns_;
  const std::size_t limit_;
  std::size_t last_ = 0;  // of the columns that are shown
  std::vector<Place> places_;
};

}  // namespace baudgate
