// SPDX-License-Identifier: Apache-2.0
#include "config/model/problem.h"

#include <algorithm>

#include "gateway/base/text.h"

namespace baudgate::config {

std::string Mark::ToString() const {
  return *file + ":" + std::to_string(line) + ":" + std::to_string(column);
}

const Mark& Keys::MarkOf(std::string_view key) const {
  const auto found = values.find(key);
  return found == values.end() ? map : found->second;
}

namespace {

constexpr std::size_t kLongestMessage = 1000;
constexpr std::string_view kEllipsis = "…";

bool IsWord(char c) {
  const auto lower = static_cast<char>(c | 0x20);
  return (lower >= 'a' && lower <= 'z') || (c >= '0' && c <= '9') || c == '_' || c == '-';
}

// Hides the text behind the secret's key in a quotation: "'1 password:SECRET'" becomes "'1
// password…'". It hides up to the last quote, because a secret may contain quotes.
void HideBehind(const std::string& secret, char quote, std::string& message) {
  const std::string lowered = Lower(message);
  for (auto at = lowered.find(secret); at != std::string::npos; at = lowered.find(secret, at + 1)) {
    const auto before = message.begin() + static_cast<std::ptrdiff_t>(at);
    const bool quoted = std::count(message.begin(), before, quote) % 2 == 1;
    if (!quoted || IsWord(message[at - 1])) continue;
    const std::size_t begin = at + secret.size();
    const auto text = message.find_first_not_of(":= ", begin);
    if (text == std::string::npos || message[text] == quote) continue;
    if (message.compare(text, kEllipsis.size(), kEllipsis) == 0) continue;
    const auto close = message.rfind(quote);
    message.replace(begin, close > begin ? close - begin : std::string::npos, kEllipsis);
    return;
  }
}

}  // namespace

std::string ToString(const Problem& problem) {
  const std::string place = problem.mark.line == 0 ? *problem.mark.file : problem.mark.ToString();
  return place + (problem.warning ? ": warning: " : ": error: ") + problem.message;
}

bool HasError(const std::vector<Problem>& problems) {
  return std::any_of(problems.begin(), problems.end(), [](const Problem& p) { return !p.warning; });
}

void Problems::Add(const Mark& mark, std::string message, bool warning) {
  // At kMost problems, one message stands for all further errors, so that they still count as an
  // error.
  if (problems_.size() > kMost || (problems_.size() == kMost && warning)) return;
  if (problems_.size() == kMost) {
    problems_.push_back(
        {{mark.file, 0, 0}, "more problems are not shown; correct these first", false});
    return;
  }
  for (const std::string& secret : secrets_) {
    for (const char quote : {'\'', '"'}) HideBehind(secret, quote, message);
  }
  // A message may quote the file, whose control characters must not reach the terminal.
  message = WithoutControls(message.substr(0, kLongestMessage));
  if (!seen_.emplace(*mark.file, mark.line, mark.column, message).second) return;
  if (std::find(files_.begin(), files_.end(), *mark.file) == files_.end()) {
    files_.push_back(*mark.file);
  }
  problems_.push_back({mark, std::move(message), warning});
}

std::string Problems::ShownKey(const std::string& key) const {
  for (const std::string& secret : secrets_) {
    if (key.size() > secret.size() && Lower(key).starts_with(secret)) {
      return "'" + key.substr(0, secret.size()).append(kEllipsis) + "'";
    }
  }
  return QuotedKey(key);
}

bool Problems::HasErrorIn(const std::string& file) const {
  return std::any_of(problems_.begin(), problems_.end(),
                     [&](const Problem& p) { return !p.warning && *p.mark.file == file; });
}

std::vector<Problem> Problems::Sorted() const {
  std::vector<Problem> sorted = problems_;
  const auto file_index = [this](const Mark& mark) {
    return std::find(files_.begin(), files_.end(), *mark.file) - files_.begin();
  };
  const bool overflow = sorted.size() > kMost;
  std::stable_sort(sorted.begin(), overflow ? sorted.end() - 1 : sorted.end(),
                   [&](const Problem& a, const Problem& b) {
                     return std::make_tuple(file_index(a.mark), a.mark.line, a.mark.column) <
                            std::make_tuple(file_index(b.mark), b.mark.line, b.mark.column);
                   });
  return sorted;
}

}  // namespace baudgate::config
