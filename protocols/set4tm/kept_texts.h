// What a batch of a meter's conversation says (EventBatch::said) has a part for each kind of what
// is kept: "journals|load profiles|billing readings". A batch brings one kind, and says of the
// others what is kept.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <string>
#include <string_view>
#include <utility>

#include "protocols/conversation.h"

namespace baudgate::protocols::set4tm {

class KeptTexts {
 public:
  static constexpr std::size_t kJournals = 0;
  static constexpr std::size_t kParts = 3;

  /// Which parts are others now; at first all.
  std::array<bool, kParts> OnKept(std::string_view said) {
    const bool first = !std::exchange(recalled_, true);
    std::array<bool, kParts> changed{};
    for (std::size_t i = 0; i < kParts; ++i) {
      const auto bar = i + 1 == kParts ? std::string_view::npos : said.find('|');
      std::string part(said.substr(0, bar));
      changed[i] = first || part != parts_[i];
      parts_[i] = std::move(part);
      said = bar == std::string_view::npos ? std::string_view() : said.substr(bar + 1);
    }
    return changed;
  }
  const std::string& part(std::size_t part) const { return parts_[part]; }

  /// `answer`, whose batch, where it has one, says only that part.
  Answer With(std::size_t part, Answer answer) const {
    if (!answer.batch) return answer;
    std::array<std::string, kParts> parts = parts_;
    parts[part] = std::move(answer.batch->said);
    std::string said = parts[0];
    for (std::size_t i = 1; i < kParts; ++i) said += '|' + parts[i];
    while (said.ends_with('|')) said.pop_back();
    answer.batch->said = std::move(said);
    return answer;
  }

 private:
  std::array<std::string, kParts> parts_;
  bool recalled_ = false;
};

}  // namespace baudgate::protocols::set4tm
