// Cuts what a client sends into request lines. Memory is bounded: a line has a longest length.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <optional>
#include <string>

namespace baudgate::control {

class RequestLines {
 public:
  explicit RequestLines(std::size_t longest) : longest_(longest) {}

  /// Where the next bytes go.
  std::array<char, 4096>& space() { return space_; }
  /// So many were put there.
  void Commit(std::size_t count) { text_.append(space_.data(), count); }

  /// The first line, even if its end is not here yet.
  bool IsTooLong() const { return std::min(text_.find('\n'), text_.size()) > longest_; }
  /// The first line, without its end; empty: its end is not here yet.
  std::optional<std::string> Take() {
    const auto end = text_.find('\n');
    if (end == std::string::npos) return std::nullopt;
    std::string line = text_.substr(0, end);
    text_.erase(0, end + 1);
    return line;
  }

 private:
  const std::size_t longest_;
  std::array<char, 4096> space_{};
  std::string text_;
};

}  // namespace baudgate::control
