// Compares the bytes of failed replies with those of good ones: a byte that converters change or
// drop is suspect if all that failed had it, and nothing good. Used by
// gateway/bus/points/findings.h.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <iterator>

#include "gateway/base/finding.h"

namespace baudgate {

class SpecialBytes {
 public:
  void Add(const Finding& finding) {
    any_high_ = any_high_ || (finding.specials & kHighBit) != 0;
    if (IsAnswered(finding.symptom)) {
      good_ = static_cast<std::uint8_t>(good_ | finding.specials);
      asked_ = static_cast<std::uint8_t>(asked_ | finding.asked);
    } else if (finding.bytes > 0) {
      any_bad_ = true;
      bad_ = static_cast<std::uint8_t>(bad_ & finding.specials);
      any_ = static_cast<std::uint8_t>(any_ | finding.specials);
    }
  }

  /// Those of kSpecialBytes that every failed reply had and no good one; one bit each.
  std::uint8_t Suspects() const {
    if (!any_bad_) return 0;
    return static_cast<std::uint8_t>(bad_ & ~good_ & kAllSpecials);
  }
  /// Those of kSpecialBytes that any request had which was answered.
  std::uint8_t AnsweredRequests() const { return asked_; }
  /// In all that failed only characters of one parity came, and FF, which a driver gives for a
  /// character with wrong parity.
  bool IsOneParity() const {
    constexpr unsigned kMark = 1U << (std::size(kSpecialBytes) - 1);
    return (any_ & kMark) != 0 && LacksOneParity();
  }
  /// The same behind a serial server, which drops such characters.
  bool LacksOneParity() const {
    const unsigned parities = any_ & kBothParities;
    return any_bad_ && (parities == kEvenByte || parities == kOddByte);
  }
  /// In all that came no character had its eighth bit, although the protocol has such.
  bool IsSevenBit() const {
    return any_bad_ && !any_high_ && (any_ & kBothParities) == kBothParities;
  }

 private:
  static constexpr unsigned kBothParities = kEvenByte | kOddByte;

  std::uint8_t asked_ = 0;   // that any request had which was answered
  std::uint8_t good_ = 0;    // that any good reply had
  std::uint8_t bad_ = 0xFF;  // that every failed one had
  std::uint8_t any_ = 0;     // that any failed one had
  bool any_bad_ = false;
  bool any_high_ = false;
};

}  // namespace baudgate
