// How wide a text is in a terminal: characters, not bytes. "°C" is two wide. WrapLines breaks text
// into lines, ColumnLayout places cells, and TextTable and StreamTable print tables.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cstddef>
#include <ostream>
#include <string>
#include <string_view>
#include <vector>

namespace baudgate::tools {

/// Whether it is a byte of a UTF-8 character, and not its first.
inline bool ContinuesCharacter(char c) { return (static_cast<unsigned char>(c) & 0xC0U) == 0x80U; }

inline std::size_t WidthOf(std::string_view text) {
  return static_cast<std::size_t>(
      std::ranges::count_if(text, [](char c) { return !ContinuesCharacter(c); }));
}

// Text in lines of a terminal: broken at words, further lines indented.

/// Lines of `width` characters at most, broken at blanks; a word that is longer is broken where its
/// line ends. One line at least. Width 0: no limit.
std::vector<std::string> WrapLines(std::string_view text, std::size_t width);

/// The same as text: each line ends in '\n', and each but the first begins with `indent` blanks.
std::string WrapSentence(std::string_view text, std::size_t width, std::size_t indent = 2);

// How the cells of a table stand in a terminal: side by side where they fit its width, else the
// later columns in further lines, indented, and the last one wrapped at words.
//
//   time                      client      point
//       old -> new  outcome   reason that goes
//                             on here
//
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
  struct CellPosition {
    std::size_t line = 0;
    std::size_t at = 0;  // characters from the left
  };

  const std::vector<ColumnShape> columns_;
  const std::size_t limit_;
  std::size_t last_ = 0;  // of the columns that are shown
  std::vector<CellPosition> places_;
};

}  // namespace baudgate::tools

namespace baudgate::tools {

// Aligned columns for people, Markdown tables for docs, CSV for spreadsheets: one table, three
// forms. Cells come from gateway/tools/cli; text goes to its streams.
class TextTable {
 public:
  explicit TextTable(std::vector<std::string> header) : header_(std::move(header)) {}

  /// As many cells as the header has.
  void Add(std::vector<std::string> row) { rows_.push_back(std::move(row)); }
  bool empty() const { return rows_.empty(); }

  /// Columns two blanks apart; columns without any content are left out. Rows that are wider than
  /// `limit` characters (0: none) are folded.
  void PrintAligned(std::ostream& out, const std::string& indent = "", std::size_t limit = 0) const;
  void PrintMarkdown(std::ostream& out) const;
  /// RFC 4180, with a header.
  void PrintCsv(std::ostream& out) const;

 private:
  std::vector<std::string> header_;
  std::vector<std::vector<std::string>> rows_;
};

}  // namespace baudgate::tools

namespace baudgate::tools {

// An aligned table whose rows come by and by. Columns only grow; when one does behind the header,
// the header is printed again above the rows that need it:
//
//   point                 outcome
//   bay-1.feeder-1.group  ok
//   point                         outcome
//   bay-1.feeder-1.setting_group  ok
//
// In a terminal rows that are too wide are folded.
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

}  // namespace baudgate::tools
