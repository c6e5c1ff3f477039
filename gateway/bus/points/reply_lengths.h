// Lengths of the replies that were asked for: up to which they come whole. Used by
// gateway/bus/points/findings.h.
//
//   7, 7, 49 damaged, 7, 49 damaged     the longest good one has 7 bytes; 49 is too long, twice
//
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cstddef>
#include <utility>

#include "gateway/base/finding.h"

namespace baudgate {

class ReplyLengths {
 public:
  /// Replies that were longer than any good one: the shortest of them, and how often one came.
  struct TooLong {
    std::size_t shortest = 0;
    std::size_t count = 0;
  };

  void Add(const Finding& finding) {
    const std::size_t length = std::max(finding.expected, finding.bytes);
    if (length == 0) return;
    if (IsAnswered(finding.symptom)) {
      OnGood(finding, length);
    } else if (length > longest_good_) {
      Count(finding.symptom == Symptom::silence ? silent_ : damaged_, length);
    } else if (finding.symptom != Symptom::silence) {
      OnDamagedAgain(length);
    }
  }

  std::size_t longest_good() const { return longest_good_; }
  /// Nothing came to requests for these.
  const TooLong& silent() const { return silent_; }
  /// These came damaged.
  const TooLong& damaged() const { return damaged_; }

 private:
  /// Long replies that come damaged so often, with no whole one between, are no chance.
  static constexpr std::size_t kNoChance = 24;

  static void Count(TooLong& lengths, std::size_t length) {
    lengths.shortest = lengths.count == 0 ? length : std::min(lengths.shortest, length);
    ++lengths.count;
  }
  void OnGood(const Finding& finding, std::size_t length) {
    // A refusal may be shorter than the reply that was asked for.
    const std::size_t came = finding.bytes > 0 ? finding.bytes : length;
    longest_good_ =
        std::max(longest_good_, finding.expected > 0 ? std::min(came, finding.expected) : came);
    if (longest_good_ >= silent_.shortest) silent_ = {};
    if (longest_good_ >= damaged_.shortest) damaged_ = {};
    if (came >= again_.shortest) again_ = {};
    good_since_ = again_.count == 0 ? 0 : std::max(good_since_, came);
  }
  void OnDamagedAgain(std::size_t length) {
    Count(again_, length);
    if (again_.count < kNoChance || good_since_ == 0) return;
    // They came whole before, and do so no more.
    longest_good_ = good_since_;
    damaged_ = std::exchange(again_, {});
  }

  std::size_t longest_good_ = 0;
  TooLong silent_;
  TooLong damaged_;
  TooLong again_;               // damaged, of a length that came whole before
  std::size_t good_since_ = 0;  // the longest that came whole meanwhile
};

}  // namespace baudgate
