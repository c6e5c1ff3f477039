// The names of sources by their numbers, which a reload changes.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <optional>
#include <utility>
#include <vector>

#include "gateway/records/events/event_book.h"

namespace baudgate::events {

/// By number. A number whose source is gone has empty names.
using SourceNames = std::vector<SourceName>;

class SourceNumbers {
 public:
  explicit SourceNumbers(SourceNames names) : names_(std::move(names)) {}

  void Renew(SourceNames names) { names_ = std::move(names); }
  /// Empty names: no source has this number.
  SourceName NameOf(Source source) const {
    return source < names_.size() ? names_[source] : SourceName();
  }
  /// Empty: it is not configured any more.
  std::optional<Source> Find(const SourceName& name) const {
    const auto found = std::ranges::find(names_, name);
    if (found == names_.end()) return std::nullopt;
    return static_cast<Source>(found - names_.begin());
  }

 private:
  SourceNames names_;
};

}  // namespace baudgate::events
