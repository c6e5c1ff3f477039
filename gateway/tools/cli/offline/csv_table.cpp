// SPDX-License-Identifier: Apache-2.0
#include "gateway/tools/cli/offline/csv_table.h"

#include <algorithm>

#include "gateway/base/spelling.h"
#include "gateway/base/text.h"

namespace baudgate {
namespace {

constexpr std::string_view kByteOrderMark = "\xEF\xBB\xBF";

/// What the line "sep=;" names, which Excel reads and other programs write for Excel; '\0': there
/// is no such line. Takes the line off the text, but not its end, so that lines count on.
char TakeNamedSeparator(std::string_view& text) {
  const std::size_t end = std::min(text.find_first_of("\r\n"), text.size());
  std::string_view line = text.substr(0, end);
  if (line.size() > 2 && line.starts_with('"') && line.ends_with('"')) {
    line = line.substr(1, line.size() - 2);
  }
  if (line.size() != 5 || config::Lower(line.substr(0, 4)) != "sep=") return '\0';
  text.remove_prefix(end);
  return line[4];
}

/// The separator of the first row that is not empty.
char SeparatorOf(std::string_view text) {
  const auto begin = text.find_first_not_of("\r\n");
  if (begin == std::string_view::npos) return ',';
  const std::string_view head = text.substr(begin, text.find_first_of("\r\n", begin) - begin);
  char best = ',';
  for (const char candidate : {';', '\t'}) {
    if (std::ranges::count(head, candidate) > std::ranges::count(head, best)) best = candidate;
  }
  return best;
}

class Reader {
 public:
  explicit Reader(CsvTable& table) : table_(table) {}

  void Read(std::string_view text) {
    for (std::size_t i = 0; i < text.size(); ++i) {
      const char c = text[i];
      if (quoted_) {
        const bool escaped = c == '"' && i + 1 < text.size() && text[i + 1] == '"';
        if (c == '"' && !escaped) {
          quoted_ = false;
          continue;
        }
        if (escaped) ++i;
        if (c == '\n') ++line_;
        cell_ += c;
      } else if (c == '"' && Trim(cell_).empty()) {
        quoted_ = true;
        cell_.clear();
      } else if (c == table_.separator) {
        EndCell();
      } else if (c == '\n') {
        EndRow();
      } else if (c != '\r') {
        cell_ += c;
      }
    }
    EndRow();
  }

 private:
  void EndCell() {
    row_.cells.emplace_back(Trim(cell_));
    cell_.clear();
  }
  void EndRow() {
    EndCell();
    row_.line = began_;
    const bool empty = std::ranges::all_of(row_.cells, [](const auto& c) { return c.empty(); });
    if (!empty) table_.rows.push_back(std::move(row_));
    row_ = {};
    began_ = ++line_;
  }

  CsvTable& table_;
  CsvRow row_;
  std::string cell_;
  bool quoted_ = false;
  int line_ = 1;
  int began_ = 1;
};

}  // namespace

CsvTable ReadCsv(std::string_view text) {
  if (text.starts_with(kByteOrderMark)) text.remove_prefix(kByteOrderMark.size());
  CsvTable table;
  const char named = TakeNamedSeparator(text);
  table.separator = named != '\0' ? named : SeparatorOf(text);
  Reader(table).Read(text);
  return table;
}

}  // namespace baudgate
