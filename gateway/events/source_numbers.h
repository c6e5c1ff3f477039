// The names of sources by their numbers, which a reload changes.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cstddef>
#include <map>
#include <optional>
#include <string>
#include <utility>

#include "gateway/events/event_book.h"
#include "gateway/events/event_table.h"

namespace baudgate::events {

class SourceNumbers {
 public:
  explicit SourceNumbers(SourceNames names) : names_(std::move(names)) {}

  /// A source that is gone has no names. By the numbers of before: who has another one now.
  std::map<Source, Source> Renew(SourceNames names) {
    std::map<Source, Source> moved;
    for (std::size_t now = 0; now < names.size(); ++now) {
      if (names[now].second.empty()) continue;
      const auto was = std::ranges::find(names_, names[now]);
      if (was == names_.end() || was - names_.begin() == static_cast<std::ptrdiff_t>(now)) continue;
      moved.emplace(static_cast<Source>(was - names_.begin()), static_cast<Source>(now));
    }
    names_ = std::move(names);
    renewed_ = names_;
    return moved;
  }
  /// Line and device. Empty: no source has this number.
  std::optional<std::pair<std::string, std::string>> NamesOf(Source source) const {
    if (source >= names_.size()) return std::nullopt;
    return names_[source];
  }
  /// Others than at the last call.
  std::optional<SourceNames> Take() { return std::exchange(renewed_, std::nullopt); }

 private:
  SourceNames names_;
  std::optional<SourceNames> renewed_;
};

}  // namespace baudgate::events
