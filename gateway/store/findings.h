// What the latest exchanges of a device looked like on the wire. Bounded memory. Probes of an
// absent device are among them.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <cstddef>
#include <optional>
#include <string>
#include <utility>

#include "gateway/base/finding.h"

namespace baudgate {

class Findings {
 public:
  static constexpr std::size_t kKept = 32;

  void Add(Finding finding) {
    idles_[count_ % kKept] = finding.idle;
    if (IsAnswered(finding.symptom)) {
      shortest_idle_ = std::min(shortest_idle_.value_or(kLongIdle), finding.idle);
    }
    latest_[count_++ % kKept] = finding.symptom;
    Keep(std::move(finding));
  }
  /// More has come for the last one that was added, or for one that was added `back` before it, and
  /// it looks otherwise now.
  void Amend(Finding finding, std::size_t back = 0) {
    if (back >= size()) return;
    latest_[(count_ - 1 - back) % kKept] = finding.symptom;
    Keep(std::move(finding));
  }

  /// How many exchanges are kept, at most kKept.
  std::size_t size() const { return std::min(count_, kKept); }
  std::size_t Count(Symptom symptom) const {
    const auto end = latest_.begin() + static_cast<std::ptrdiff_t>(size());
    return static_cast<std::size_t>(std::count(latest_.begin(), end, symptom));
  }
  /// How often failures began.
  std::size_t Runs() const {
    std::size_t runs = 0;
    bool failing = false;
    for (std::size_t i = count_ - size(); i < count_; ++i) {
      const bool fails = !IsAnswered(latest_[i % kKept]);
      runs += fails && !failing ? 1 : 0;
      failing = fails;
    }
    return runs;
  }
  /// The most that failed in a row.
  std::size_t LongestRun() const {
    std::size_t longest = 0;
    std::size_t run = 0;
    for (std::size_t i = count_ - size(); i < count_; ++i) {
      run = IsAnswered(latest_[i % kKept]) ? 0 : run + 1;
      longest = std::max(longest, run);
    }
    return longest;
  }
  /// The last one of this kind, with the longest time of those that are kept; empty where there was
  /// none.
  const Finding& Last(Symptom symptom) const { return last_[static_cast<std::size_t>(symptom)]; }

  /// Those of kSpecialBytes that every failed reply had and no good one; one bit each.
  std::uint8_t Suspects() const {
    if (!any_bad_) return 0;
    return static_cast<std::uint8_t>(bad_specials_ & ~good_specials_ & kAllSpecials);
  }
  /// In all that failed only characters of one parity came, and FF, which a driver gives for a
  /// character with wrong parity.
  bool IsOneParity() const {
    constexpr unsigned kMark = 1U << (std::size(kSpecialBytes) - 1);
    const unsigned parities = any_specials_ & kBothParities;
    return (any_specials_ & kMark) != 0 && (parities == kEvenByte || parities == kOddByte);
  }
  /// The same behind a serial server, which drops such characters.
  bool LacksOneParity() const {
    const unsigned parities = any_specials_ & kBothParities;
    return any_bad_ && (parities == kEvenByte || parities == kOddByte);
  }
  /// In all that came no character had its eighth bit, although the protocol has such.
  bool IsSevenBit() const {
    return any_bad_ && !any_high_ && (any_specials_ & kBothParities) == kBothParities;
  }

  /// Around so many replies, one after another where anything was, the same bytes stood; and which.
  std::size_t SameAround() const { return same_around_; }
  const std::string& Around() const { return around_; }

  /// The longest silence before a request to which nothing came, where every request that was ever
  /// answered had a longer one before it; zero: it is not so.
  Duration ShortPause() const {
    Duration longest{};
    for (std::size_t i = 0; i < size(); ++i) {
      if (latest_[i] == Symptom::silence) longest = std::max(longest, idles_[i]);
    }
    return shortest_idle_ && *shortest_idle_ > longest ? longest : Duration();
  }

  /// The shortest silence before a request that was ever answered; empty: none was, or what was
  /// before it is not known.
  std::optional<Duration> ShortestAnswered() const {
    return shortest_idle_ == kLongIdle ? std::nullopt : shortest_idle_;
  }

  /// The reverse: the shortest silence before a request to which nothing came, where every one of
  /// these requests that was answered had a shorter one before it.
  Duration LongRest() const {
    Duration shortest = kLongIdle;
    Duration longest{};
    for (std::size_t i = 0; i < size(); ++i) {
      if (latest_[i] == Symptom::silence) shortest = std::min(shortest, idles_[i]);
      const bool counts = IsAnswered(latest_[i]) && idles_[i] != kLongIdle;
      if (counts) longest = std::max(longest, idles_[i]);
    }
    return shortest != kLongIdle && shortest > longest ? shortest : Duration();
  }

  /// Words for people that came since the last reply beside which there were none; empty: none.
  const Finding& LatestWords() const { return words_; }

  /// Lengths of replies that were asked for: the longest that came whole, the shortest that did
  /// not; and how often one did not that was longer than any that did. Nothing came, or damage.
  struct Lengths {
    std::size_t shortest = 0;
    std::size_t count = 0;
  };
  std::size_t LongestGood() const { return longest_good_; }
  const Lengths& SilentLong() const { return silent_; }
  const Lengths& DamagedLong() const { return damaged_; }

 private:
  /// Long replies that come damaged so often, with no whole one between, are no chance.
  static constexpr std::size_t kNoChance = 24;
  static constexpr unsigned kBothParities = kEvenByte | kOddByte;

  void KeepLength(const Finding& finding) {
    const std::size_t length = std::max(finding.expected, finding.bytes);
    if (length == 0) return;
    if (IsAnswered(finding.symptom)) {
      // A refusal may be shorter than the reply that was asked for.
      const std::size_t came = finding.bytes > 0 ? finding.bytes : length;
      longest_good_ =
          std::max(longest_good_, finding.expected > 0 ? std::min(came, finding.expected) : came);
      if (longest_good_ >= silent_.shortest) silent_ = {};
      if (longest_good_ >= damaged_.shortest) damaged_ = {};
      if (came >= again_.shortest) again_ = {};
      good_since_ = again_.count == 0 ? 0 : std::max(good_since_, came);
      return;
    }
    Lengths& lengths = finding.symptom == Symptom::silence ? silent_ : damaged_;
    if (length <= longest_good_ && finding.symptom != Symptom::silence) {
      again_.shortest = again_.count == 0 ? length : std::min(again_.shortest, length);
      if (++again_.count < kNoChance || good_since_ == 0) return;
      // They came whole before, and do so no more.
      longest_good_ = good_since_;
      damaged_ = std::exchange(again_, {});
      return;
    }
    if (length <= longest_good_) return;
    lengths.shortest = lengths.count == 0 ? length : std::min(lengths.shortest, length);
    ++lengths.count;
  }
  void KeepAround(const Finding& finding) {
    if (finding.symptom != Symptom::few_beside && finding.symptom != Symptom::noise_before &&
        finding.symptom != Symptom::noise_behind && finding.symptom != Symptom::text_beside) {
      return;
    }
    same_around_ = finding.cause == around_ ? same_around_ + 1 : 1;
    around_ = finding.cause;
  }
  void Keep(Finding finding) {
    any_high_ = any_high_ || (finding.specials & kHighBit) != 0;
    KeepLength(finding);
    KeepAround(finding);
    if (finding.symptom == Symptom::text || finding.symptom == Symptom::text_beside) {
      words_ = finding;
    } else if (IsAnswered(finding.symptom)) {
      words_ = {};
    }
    if (IsAnswered(finding.symptom)) {
      good_specials_ = static_cast<std::uint8_t>(good_specials_ | finding.specials);
    } else if (finding.bytes > 0) {
      any_bad_ = true;
      bad_specials_ = static_cast<std::uint8_t>(bad_specials_ & finding.specials);
      any_specials_ = static_cast<std::uint8_t>(any_specials_ | finding.specials);
    }
    Finding& last = last_[static_cast<std::size_t>(finding.symptom)];
    const bool others = Count(finding.symptom) > 1;
    if (others) finding.time = std::max(finding.time, last.time);
    last = std::move(finding);
  }

  std::array<Symptom, kKept> latest_{};
  std::array<Duration, kKept> idles_{};
  std::optional<Duration> shortest_idle_;  // before a request that was answered
  std::size_t count_ = 0;
  std::size_t longest_good_ = 0;
  Lengths silent_;
  Lengths damaged_;
  Lengths again_;               // damaged, of a length that came whole before
  std::size_t good_since_ = 0;  // the longest that came whole meanwhile
  Finding words_;
  std::uint8_t good_specials_ = 0;
  std::uint8_t bad_specials_ = 0xFF;
  std::uint8_t any_specials_ = 0;
  bool any_bad_ = false;
  bool any_high_ = false;
  std::size_t same_around_ = 0;
  std::string around_;
  std::array<Finding, kSymptoms> last_{};
};

}  // namespace baudgate
