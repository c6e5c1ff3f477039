// SPDX-License-Identifier: Apache-2.0
#include "gateway/outputs/dds/link/bounded_lines.h"

#include <utility>

#include "gateway/base/shown.h"

namespace baudgate::dds {

std::vector<std::string> BoundedLines::Add(std::string_view bytes, Instant now) {
  std::vector<std::string> lines;
  for (const char c : bytes) {
    if (c == '\n') {
      Finish(now, lines);
    } else if (line_.size() < kLongest) {
      line_ += c;
    }
  }
  return lines;
}

void BoundedLines::Finish(Instant now, std::vector<std::string>& lines) {
  const std::string line = Harmless(std::exchange(line_, {}));
  if (line.empty()) return;
  if (now >= period_end_) {
    period_end_ = now + kPeriod;
    told_ = 0;
    if (const std::size_t count = std::exchange(left_out_, 0); count > 0) {
      lines.push_back(std::to_string(count) + " lines were left out");
    }
  }
  if (told_ < kMost) {
    ++told_;
    lines.push_back(line);
  } else {
    ++left_out_;
  }
}

}  // namespace baudgate::dds
