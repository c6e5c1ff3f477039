// SPDX-License-Identifier: Apache-2.0
#include "gateway/tools/terminal/text_table.h"

#include <algorithm>

#include "gateway/base/csv.h"
#include "gateway/base/text.h"
#include "gateway/tools/terminal/column_layout.h"
#include "gateway/tools/terminal/width.h"

namespace baudgate::config {
namespace {

std::string MarkdownCell(const std::string& text) {
  std::string escaped;
  for (const char c : text) {
    if (c == '|') escaped += '\\';
    escaped += c;
  }
  return escaped;
}

template <typename Escape>
void PrintJoined(std::ostream& out, const std::vector<std::string>& cells, const char* before,
                 const char* between, const char* after, Escape escape) {
  out << before;
  for (std::size_t i = 0; i < cells.size(); ++i) {
    if (i > 0) out << between;
    out << escape(cells[i]);
  }
  out << after << '\n';
}

}  // namespace

void TextTable::PrintAligned(std::ostream& out, const std::string& indent,
                             std::size_t limit) const {
  std::vector<ColumnShape> shapes(header_.size());
  for (const auto& row : rows_) {
    for (std::size_t i = 0; i < header_.size(); ++i) {
      shapes[i].width = std::max(shapes[i].width, WidthOf(row[i]));
    }
  }
  for (std::size_t i = 0; i < header_.size(); ++i) {
    if (shapes[i].width > 0) shapes[i].width = std::max(shapes[i].width, WidthOf(header_[i]));
  }
  const ColumnLayout layout(shapes, limit - std::min(limit, indent.size()));
  const auto print = [&](const std::vector<std::string>& cells) {
    const std::string lines = layout.Row(cells);
    for (const auto line : Split(std::string_view(lines).substr(0, lines.size() - 1), '\n')) {
      out << (line.empty() ? "" : indent) << line << '\n';
    }
  };
  print(header_);
  for (const auto& row : rows_) print(row);
}

void TextTable::PrintMarkdown(std::ostream& out) const {
  PrintJoined(out, header_, "| ", " | ", " |", MarkdownCell);
  PrintJoined(out, std::vector<std::string>(header_.size(), "---"), "| ", " | ", " |",
              MarkdownCell);
  for (const auto& row : rows_) PrintJoined(out, row, "| ", " | ", " |", MarkdownCell);
}

void TextTable::PrintCsv(std::ostream& out) const {
  out << CsvLine(header_);
  for (const auto& row : rows_) out << CsvLine(row);
}

}  // namespace baudgate::config
