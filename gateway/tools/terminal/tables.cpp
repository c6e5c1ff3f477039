// SPDX-License-Identifier: Apache-2.0
#include "gateway/tools/terminal/tables.h"

#include <limits>
#include <utility>

#include "gateway/base/shown.h"
#include "gateway/base/text.h"

namespace baudgate::tools {
namespace {

constexpr std::size_t kLeastWidth = 20;  // lines are not made narrower than this

/// Returns how many bytes the first `width` characters have.
std::size_t BytesOf(std::string_view text, std::size_t width) {
  std::size_t at = 0;
  for (std::size_t seen = 0; at < text.size(); ++at) {
    if (!ContinuesCharacter(text[at]) && seen++ == width) break;
  }
  return at;
}

/// Removes one line, and the blanks behind it, from the front of `text`, and returns the line.
std::string TakeLine(std::string_view& text, std::size_t width) {
  std::size_t end = BytesOf(text, width);
  if (end < text.size() && text[end] != ' ') {
    const std::size_t blank = text.rfind(' ', end);
    const std::size_t word = blank == std::string_view::npos ? blank : text.find_first_not_of(' ');
    if (blank != std::string_view::npos && word < blank) end = blank;
  }
  std::string line(text.substr(0, end));
  text.remove_prefix(std::min(text.find_first_not_of(' ', end), text.size()));
  line.erase(line.find_last_not_of(' ') + 1);
  return line;
}

}  // namespace

std::vector<std::string> WrapLines(std::string_view text, std::size_t width) {
  if (width == 0) return {std::string(text)};
  std::vector<std::string> lines;
  do {
    lines.push_back(TakeLine(text, width));
  } while (!text.empty());
  return lines;
}

std::string WrapSentence(std::string_view text, std::size_t width, std::size_t indent) {
  if (width == 0) return std::string(text) + "\n";
  std::string_view rest = text;
  std::string wrapped = TakeLine(rest, std::max(width, kLeastWidth)) + "\n";
  if (rest.empty()) return wrapped;
  for (const std::string& line :
       WrapLines(rest, std::max(width - std::min(width, indent), kLeastWidth))) {
    wrapped += std::string(indent, ' ') + line + "\n";
  }
  return wrapped;
}

namespace {

constexpr std::size_t kColumnGap = 2;
constexpr std::size_t kFoldIndent = 4;  // indent of the second and later lines of a row
constexpr std::size_t kLeastLast = 20;  // minimum width of a wrapped last column

void Put(std::string& line, std::size_t at, const std::string& text) {
  line.append(at - std::min(at, WidthOf(line)), ' ').append(text);
}

std::string Trimmed(std::string line) {
  line.erase(line.find_last_not_of(' ') + 1);
  return line + "\n";
}

}  // namespace

ColumnLayout::ColumnLayout(std::vector<ColumnShape> columns, std::size_t limit)
    : columns_(std::move(columns)), limit_(limit), places_(columns_.size()) {
  for (std::size_t i = 0; i < columns_.size(); ++i) {
    if (columns_[i].width > 0) last_ = i;
  }
  CellPosition next;
  for (std::size_t i = 0; i < columns_.size(); ++i) {
    if (columns_[i].width == 0) continue;
    const bool wraps = i == last_ && !columns_[i].right;
    const std::size_t needed = wraps ? std::min(columns_[i].width, kLeastLast) : columns_[i].width;
    if (limit_ > 0 && next.at > kFoldIndent && next.at + needed > limit_)
      next = {next.line + 1, kFoldIndent};
    places_[i] = next;
    next.at += columns_[i].width + kColumnGap;
  }
}

std::string ColumnLayout::Row(const std::vector<std::string>& cells) const {
  std::vector<std::string> lines(1);
  for (std::size_t i = 0; i < columns_.size(); ++i) {
    if (columns_[i].width == 0) continue;
    const CellPosition place = places_[i];
    lines.resize(std::max(lines.size(), place.line + 1));
    const std::size_t blank = columns_[i].width - std::min(columns_[i].width, WidthOf(cells[i]));
    if (i < last_ || columns_[i].right) {
      Put(lines[place.line], place.at + (columns_[i].right ? blank : 0), cells[i]);
      continue;
    }
    const std::size_t room = limit_ == 0 ? 0 : limit_ - std::min(limit_ - 1, place.at);
    const auto parts = WrapLines(cells[i], room);
    lines.resize(place.line + parts.size());
    for (std::size_t j = 0; j < parts.size(); ++j) Put(lines[place.line + j], place.at, parts[j]);
  }
  std::string text = Trimmed(lines.front());
  for (std::size_t i = 1; i < lines.size(); ++i) {
    if (const std::string line = Trimmed(lines[i]); line != "\n") text += line;
  }
  return text;
}

}  // namespace baudgate::tools

namespace baudgate::tools {
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

}  // namespace baudgate::tools

namespace baudgate::tools {

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

}  // namespace baudgate::tools
