// What the latest exchanges of a device looked like on the wire. Bounded memory. Probes of an
// absent device are among them.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <utility>

#include "gateway/base/finding.h"

namespace baudgate {

class Findings {
 public:
  static constexpr std::size_t kKept = 32;

  void Add(Finding finding) {
    latest_[count_++ % kKept] = finding.symptom;
    Keep(std::move(finding));
  }
  /// More has come for the last one that was added, and it looks otherwise now.
  void Amend(Finding finding) {
    if (count_ == 0) return;
    latest_[(count_ - 1) % kKept] = finding.symptom;
    Keep(std::move(finding));
  }

  /// Of the exchanges that are kept, at most kKept.
  std::size_t size() const { return std::min(count_, kKept); }
  std::size_t Count(Symptom symptom) const {
    const auto end = latest_.begin() + static_cast<std::ptrdiff_t>(size());
    return static_cast<std::size_t>(std::count(latest_.begin(), end, symptom));
  }
  /// The last one of this kind, with the longest time of those that are kept; empty where there was
  /// none.
  const Finding& Last(Symptom symptom) const { return last_[static_cast<std::size_t>(symptom)]; }

 private:
  void Keep(Finding finding) {
    Finding& last = last_[static_cast<std::size_t>(finding.symptom)];
    const bool others = Count(finding.symptom) > 1;
    if (others) finding.time = std::max(finding.time, last.time);
    last = std::move(finding);
  }

  std::array<Symptom, kKept> latest_{};
  std::size_t count_ = 0;
  std::array<Finding, kSymptoms> last_{};
};

}  // namespace baudgate
