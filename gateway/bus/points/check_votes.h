// How check values may be computed that were wrong: whether most of them were so in the same way.
// One that damage has changed is so in any way. Bounded memory.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>

#include "gateway/base/finding.h"

namespace baudgate {

class CheckVotes {
 public:
  /// The vote of each against the one that most were for so far.
  void Add(const Finding& finding) {
    if (finding.symptom != Symptom::bad_check || finding.remedy.empty()) return;
    const bool same = finding.remedy == most_.remedy;
    votes_ = std::min(votes_ + (same ? 1 : -1), 2 * kNoChance);
    if (votes_ > 0) return;
    most_ = finding;
    votes_ = 1;
  }
  /// Null: they were not wrong in the same way.
  const Finding* winner() const { return votes_ >= kNoChance ? &most_ : nullptr; }

 private:
  static constexpr int kNoChance = 4;

  Finding most_;
  int votes_ = 0;
};

}  // namespace baudgate
