// Functions for the width of text in a terminal, and for tables. `WidthOf` returns the width in
// characters, not bytes: "°C" has width 2.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cstddef>
#include <ostream>
#include <string>
#include <string_view>
#include <vector>

namespace baudgate::tools {

/// True for a byte of a UTF-8 character that is not the character's first byte.
inline bool ContinuesCharacter(char c) { return (static_cast<unsigned char>(c) & 0xC0U) == 0x80U; }

inline std::size_t WidthOf(std::string_view text) {
  return static_cast<std::size_t>(
      std::ranges::count_if(text, [](char c) { return !ContinuesCharacter(c); }));
}

/// Breaks a text at blanks into lines of at most `width` characters; 0: no limit. A longer word is
/// broken at the end of its line. Returns at least one line.
std::vector<std::string> WrapLines(std::string_view text, std::size_t width);

/// Breaks a text as WrapLines does, and returns the lines as one text. Each line ends in a line
/// feed, and each line but the first begins with `indent` blanks.
std::string WrapSentence(std::string_view text, std::size_t width, std::size_t indent = 2);

// `ColumnLayout` places the cells of a table row in a terminal. Cells are side by side if they fit
// the width of the terminal. Otherwise later columns go to further, indented lines, and the last
// column is wrapped at words.
//
//   time                      client      point
//       old -> new  outcome   reason that goes
//                             on here
struct ColumnShape {
  std::size_t width = 0;  ///< 0: the column is left out
  bool right = false;     ///< right-aligned, for numbers
};

class ColumnLayout {
 public:
  /// `limit`: number of characters in a line; 0: no limit.
  ColumnLayout(std::vector<ColumnShape> columns, std::size_t limit);

  /// Returns the lines of one row, each with a line feed at its end. `cells` must have one element
  /// for each column. Empty lines are left out, except the first.
  std::string Row(const std::vector<std::string>& cells) const;

 private:
  struct CellPosition {
    std::size_t line = 0;
    std::size_t at = 0;  // position in the line, in characters
  };

  const std::vector<ColumnShape> columns_;
  const std::size_t limit_;
  std::size_t last_ = 0;  // index of the last column that is not left out
  std::vector<CellPosition> places_;
};

}  // namespace baudgate::tools

namespace baudgate::tools {

// `TextTable` prints a table in one of three forms: aligned columns for terminals, Markdown for
// documents, CSV for spreadsheets.
class TextTable {
 public:
  explicit TextTable(std::vector<std::string> header) : header_(std::move(header)) {}

  /// `row` must have as many cells as the header.
  void Add(std::vector<std::string> row) { rows_.push_back(std::move(row)); }
  bool empty() const { return rows_.empty(); }

  /// Prints columns with two blanks between them. Leaves out columns without content. Rows wider
  /// than `limit` characters (0: no limit) are folded into several lines.
  void PrintAligned(std::ostream& out, const std::string& indent = "", std::size_t limit = 0) const;
  void PrintMarkdown(std::ostream& out) const;
  /// Prints CSV as in RFC 4180, with a header.
  void PrintCsv(std::ostream& out) const;

 private:
  std::vector<std::string> header_;
  std::vector<std::vector<std::string>> rows_;
};

}  // namespace baudgate::tools

namespace baudgate::tools {

// `StreamTable` prints an aligned table whose rows come one after the other. Columns never get
// narrower. When a column gets wider after the header was printed, the header is printed again
// above the new rows:
//
//   point                 outcome
//   bay-1.feeder-1.group  ok
//   point                         outcome
//   bay-1.feeder-1.setting_group  ok
//
// In a terminal, rows that are too wide are folded into several lines.
class StreamTable {
 public:
  struct Column {
    std::string title{};
    /// Initial width if lines have no limit; not less than the width of the title.
    std::size_t width = 0;
    bool right = false;  ///< right-aligned, for numbers
  };
  using Row = std::vector<std::string>;

  /// `limit`: number of characters in a line; 0: no limit.
  explicit StreamTable(std::vector<Column> columns, std::size_t limit = 0);

  /// Each row must have one cell for each column. The last cell can have any length.
  void Print(const std::vector<Row>& rows, std::ostream& out);

 private:
  bool Grow(const std::vector<Row>& rows);

  std::vector<Column> columns_;
  const std::size_t limit_;
  bool headed_ = false;
};

}  // namespace baudgate::tools
