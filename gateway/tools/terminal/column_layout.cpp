// SPDX-License-Identifier: Apache-2.0
#include "gateway/tools/terminal/column_layout.h"

#include <algorithm>
#include <utility>

#include "gateway/tools/terminal/width.h"
#include "gateway/tools/terminal/wrap.h"

namespace baudgate {
namespace {

constexpr std::size_t kColumnGap = 2;
constexpr std::size_t kFoldIndent = 4;  // of further lines
constexpr std::size_t kLeastLast = 20;  // the last column may be wrapped to

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
  Place next;
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
    const Place place = places_[i];
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

}  // namespace baudgate
