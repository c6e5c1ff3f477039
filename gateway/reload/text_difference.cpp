// SPDX-License-Identifier: Apache-2.0
#include "gateway/reload/text_difference.h"

#include <algorithm>
#include <cstdint>

namespace baudgate::reload {
namespace {

using Texts = std::vector<std::string_view>;

/// Beyond so many pairs of lines the middle is told as replaced.
constexpr std::size_t kMostPairs = 25'000'000;

Texts LinesOf(std::string_view text) {
  Texts lines;
  while (!text.empty()) {
    const std::size_t end = text.find('\n');
    lines.push_back(text.substr(0, end));
    text.remove_prefix(end == std::string_view::npos ? text.size() : end + 1);
  }
  return lines;
}

void Put(std::vector<std::string>& out, const char* sign, Texts::const_iterator from,
         Texts::const_iterator to) {
  for (; from != to; ++from) out.push_back(sign + std::string(*from));
}

/// Between the common beginning and end: by the longest common run of lines.
void Middle(const Texts& a, const Texts& b, std::vector<std::string>& out) {
  if (a.size() * b.size() > kMostPairs) {
    Put(out, "- ", a.begin(), a.end());
    return Put(out, "+ ", b.begin(), b.end());
  }
  const std::size_t width = b.size() + 1;
  std::vector<std::uint32_t> common((a.size() + 1) * width);
  for (std::size_t i = a.size(); i-- > 0;) {
    for (std::size_t j = b.size(); j-- > 0;) {
      common[i * width + j] =
          a[i] == b[j] ? common[(i + 1) * width + j + 1] + 1
                       : std::max(common[(i + 1) * width + j], common[i * width + j + 1]);
    }
  }
  std::size_t i = 0;
  std::size_t j = 0;
  while (i < a.size() || j < b.size()) {
    if (i < a.size() && j < b.size() && a[i] == b[j]) {
      out.push_back("  " + std::string(a[i]));
      ++i;
      ++j;
    } else if (j == b.size() ||
               (i < a.size() && common[(i + 1) * width + j] >= common[i * width + j + 1])) {
      out.push_back("- " + std::string(a[i++]));
    } else {
      out.push_back("+ " + std::string(b[j++]));
    }
  }
}

}  // namespace

std::vector<std::string> TextDifference(std::string_view before, std::string_view after,
                                        std::size_t context) {
  Texts a = LinesOf(before);
  Texts b = LinesOf(after);
  if (a == b) return {};
  const auto [from_a, from_b] = std::ranges::mismatch(a, b);
  const auto same = static_cast<std::size_t>(from_a - a.begin());
  std::size_t tail = 0;
  while (tail < std::min(a.size(), b.size()) - same &&
         a[a.size() - 1 - tail] == b[b.size() - 1 - tail]) {
    ++tail;
  }
  const auto end_a = a.end() - static_cast<std::ptrdiff_t>(tail);
  const auto end_b = b.end() - static_cast<std::ptrdiff_t>(tail);
  std::vector<std::string> all;
  Put(all, "  ", a.begin(), from_a);
  Middle(Texts(from_a, end_a), Texts(from_b, end_b), all);
  Put(all, "  ", end_a, a.end());
  std::vector<std::string> shown;
  for (std::size_t i = 0; i < all.size(); ++i) {
    const std::size_t first = i > context ? i - context : 0;
    const std::size_t last = std::min(all.size(), i + context + 1);
    const bool near = std::any_of(all.begin() + static_cast<std::ptrdiff_t>(first),
                                  all.begin() + static_cast<std::ptrdiff_t>(last),
                                  [](const std::string& line) { return line[0] != ' '; });
    if (near) shown.push_back(all[i]);
    if (!near && (shown.empty() || shown.back() != "…")) shown.emplace_back("…");
  }
  return shown;
}

}  // namespace baudgate::reload
