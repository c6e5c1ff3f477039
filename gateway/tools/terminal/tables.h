// `WidthOf` returns how wide a text is in a terminal: in characters, not bytes. "°C" is two wide.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cstddef>
#include <ostream>
#include <string>
#include <string_view>
#include <vector>

namespace baudgate::tools {

/// True for a byte of a UTF-8 character that is not its first byte.
inline bool ContinuesCharacter(char c) { return (static_cast<unsigned char>(c) & 0xC0U) == 0x80U; }

inline std::size_t WidthOf(std::string_view text) {
  return static_cast<std::size_t>(
      std::ranges::count_if(text, [](char c) { return !ContinuesCharacter(c); }));
}

/// Breaks text at blanks into lines of at most `width` characters. A longer word is broken at the
/// end of its line. Returns at least one line. Width 0: no limit.
std::vector<std::string> WrapLines(std::string_view text, std::size_t width);

/// Returns the lines as text: each line ends in '\n', and each line but the first begins with
/// `indent` blanks.
std::string WrapSentence(std::string_view text, std::size_t width, std::size_t indent = 2);

// `ColumnLayout` places the cells of a table row in a terminal. Cells are side by side if they fit
// its width. Otherwise later columns go to further, indented lines, and the last column is wrapped
// at words.
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
  /// `limit`: characters in a line; 0: no limit.
  ColumnLayout(std::vector<ColumnShape> columns, std::size_t limit);

  /// Returns the lines of one row, which end in '\n'. `cells` must have as many elements as there
  /// are columns. Lines without content are left out, except the first.
  std::string Row(const std::vector<std::string>& cells) const;

 private:
  struct CellPosition {
    std::size_t line = 0;
    std::size_t at = 0;  // characters from the left
  };

  const std::vector<ColumnShape> columns_;
  const std::size_t limit_;
  std::size_t last_ = 0;  // index of the last column that is shown
  std::vector<CellPosition> places_;
};

}  // namespace baudgate::tools

namespace baudgate::tools {

// `TextTable` prints a table in one of three forms: aligned columns for people, Markdown for docs,
// CSV for spreadsheets.
class TextTable {
 public:
  explicit TextTable(std::vector<std::string> header) : header_(std::move(header)) {}

  /// Adds a row; it must have as many cells as the header.
  void Add(std::vector<std::string> row) { rows_.push_back(std::move(row)); }
  bool empty() const { return rows_.empty(); }

  /// Prints columns two blanks apart; columns without content are left out. Rows wider than `limit`
  /// characters (0: no limit) are folded.
  void PrintAligned(std::ostream& out, const std::string& indent = "", std::size_t limit = 0) const;
  void PrintMarkdown(std::ostream& out) const;
  /// Prints CSV after RFC 4180, with a header.
  void PrintCsv(std::ostream& out) const;

 private:
  std::vector<std::string> header_;
  std::vector<std::vector<std::string>> rows_;
};

}  // namespace baudgate::tools

namespace baudgate::tools {

// `StreamTable` prints an aligned table whose rows come one after the other. Columns only grow;
// when a column grows after the header was printed, the header is printed again above the new rows:
//
//   point                 outcome
//   bay-1.feeder-1.group  ok
//   point                         outcome
//   bay-1.feeder-1.setting_group  ok
//
// In a terminal, rows that are too wide are folded.
class StreamTable {
 public:
  struct Column {
    std::string title{};
    std::size_t width = 0;  ///< initial width if lines have no limit; at least the title's width
    bool right = false;     ///< right-aligned, for numbers
  };
  using Row = std::vector<std::string>;

  /// `limit`: characters in a line; 0: no limit.
  explicit StreamTable(std::vector<Column> columns, std::size_t limit = 0);

  /// Prints rows. Each row must have as many cells as there are columns; the last cell may have any
  /// length.
  void Print(const std::vector<Row>& rows, std::ostream& out);

 private:
  bool Grow(const std::vector<Row>& rows);

  std::vector<Column> columns_;
  const std::size_t limit_;
  bool headed_ = false;
};

}  // namespace baudgate::tools
