// SPDX-License-Identifier: Apache-2.0
#include "gateway/tools/terminal/wrap.h"

#include <algorithm>

#include "gateway/tools/terminal/width.h"

namespace baudgate {
namespace {

constexpr std::size_t kLeastWidth = 20;  // where an indent would leave nothing

/// Bytes of the first `width` characters.
std::size_t BytesOf(std::string_view text, std::size_t width) {
  std::size_t at = 0;
  for (std::size_t seen = 0; at < text.size(); ++at) {
    if (!ContinuesCharacter(text[at]) && seen++ == width) break;
  }
  return at;
}

/// Takes one line from the front of `text`, and the blanks after it.
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

}  // namespace baudgate
