// What the latest exchanges of a device looked like on the wire, probes of an absent device
// included. Bounded memory. The last 32 exchanges show how the device is now. The last 32 failures
// of two minutes show what its failures look like, so that the cause does not change with each
// look. CheckVotes, ReplyLengths and SpecialBytes count one property each for Findings.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <array>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <iterator>
#include <memory>
#include <optional>
#include <string>
#include <utility>

#include "gateway/base/finding.h"

namespace baudgate::bus {

// How check values may be computed that were wrong: whether most of them were so in the same way.
// One that damage has changed is so in any way. Bounded memory.
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

// Lengths of the replies that were asked for: up to which they come whole.
//
//   7, 7, 49 damaged, 7, 49 damaged     the longest good one has 7 bytes; 49 is too long, twice
//
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

// Compares the bytes of failed replies with those of good ones: a byte that converters change or
// drop is suspect if all that failed had it, and nothing good.
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

class Findings {
 public:
  static constexpr std::size_t kKept = 32;
  using Counts = std::array<std::size_t, kSymptoms>;

  void Add(Finding finding, Instant at = {}) {
    idles_[count_ % kKept] = finding.idle;
    if (IsAnswered(finding.symptom)) {
      shortest_idle_ = std::min(shortest_idle_.value_or(kLongIdle), finding.idle);
    }
    latest_[count_++ % kLong] = {finding.symptom, at};
    Keep(std::move(finding));
  }
  /// More has come for the last one that was added, or for one that was added `back` before it, and
  /// it looks otherwise now.
  void Amend(Finding finding, std::size_t back = 0) {
    if (back >= size()) return;
    latest_[(count_ - 1 - back) % kLong].symptom = finding.symptom;
    Keep(std::move(finding));
  }

  /// How many exchanges are kept, at most kKept.
  std::size_t size() const { return std::min(count_, kKept); }
  std::size_t Count(Symptom symptom) const {
    std::size_t count = 0;
    for (std::size_t i = count_ - size(); i < count_; ++i) count += At(i) == symptom ? 1 : 0;
    return count;
  }
  /// How often each symptom stands among the last kKept failures that are younger than kMemory.
  Counts Failures() const {
    Counts counts{};
    std::size_t found = 0;
    const Instant newest = count_ > 0 ? latest_[(count_ - 1) % kLong].at : Instant{};
    for (std::size_t i = count_; i > count_ - std::min(count_, kLong) && found < kKept; --i) {
      const Look& look = latest_[(i - 1) % kLong];
      if (newest - look.at > kMemory) break;
      if (IsAnswered(look.symptom)) continue;
      ++counts[static_cast<std::size_t>(look.symptom)];
      ++found;
    }
    return counts;
  }
  /// How often words came right behind silence, and an answer soon behind them: a start.
  std::size_t Starts() const {
    const auto is_text = [](Symptom symptom) {
      return symptom == Symptom::text || symptom == Symptom::text_beside;
    };
    std::size_t starts = 0;
    std::size_t texts = 0;
    bool open = false;  // a text has come behind silence, and no answer yet
    for (std::size_t i = count_ - std::min(count_, kLong); i < count_; ++i) {
      const bool is_first = i > 0 && At(i - 1) == Symptom::silence && is_text(At(i));
      texts += is_text(At(i)) ? 1 : 0;
      open = open || is_first;
      starts += open && IsAnswered(At(i)) ? 1 : 0;
      open = open && !IsAnswered(At(i));
    }
    return 2 * starts >= texts ? starts : 0;
  }
  /// How often failures began.
  std::size_t Runs() const {
    std::size_t runs = 0;
    bool failing = false;
    for (std::size_t i = count_ - size(); i < count_; ++i) {
      const bool fails = !IsAnswered(At(i));
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
      run = IsAnswered(At(i)) ? 0 : run + 1;
      longest = std::max(longest, run);
    }
    return longest;
  }
  /// The last one of this kind, with the longest time of those that are kept; empty where there was
  /// none.
  const Finding& Last(Symptom symptom) const { return last_[static_cast<std::size_t>(symptom)]; }

  /// Which bytes its replies had, and how long they were.
  const SpecialBytes& specials() const { return specials_; }
  const ReplyLengths& lengths() const { return lengths_; }

  /// Around so many replies, one after another where anything was, the same bytes stood; and which.
  std::size_t SameAround() const { return same_around_; }
  const std::string& Around() const { return around_; }

  /// How the check values may be computed that are wrong, where most of them were so in the same
  /// way; null: they were not.
  const Finding* Check() const { return checks_.winner(); }

  /// Messages that come unasked come in bursts: the shortest and the longest silence between two
  /// bursts. Empty: there were none, or one was shorter than `least`.
  std::optional<std::pair<Duration, Duration>> Period(Duration least) const {
    std::optional<std::pair<Duration, Duration>> period;
    for (std::size_t i = 0; i < size(); ++i) {
      if (idles_[i] == kLongIdle || 4 * idles_[i] < least) continue;
      if (idles_[i] < least) return std::nullopt;
      period = period ? std::pair(std::min(period->first, idles_[i]),
                                  std::max(period->second, idles_[i]))
                      : std::pair(idles_[i], idles_[i]);
    }
    return period;
  }

  /// The longest silence before a request to which nothing came, where every request that was ever
  /// answered had a longer one before it; zero: it is not so.
  Duration ShortPause() const {
    Duration longest{};
    for (std::size_t i = 0; i < size(); ++i) {
      if (Kept(i) == Symptom::silence) longest = std::max(longest, idles_[i]);
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
      if (Kept(i) == Symptom::silence) shortest = std::min(shortest, idles_[i]);
      const bool counts = IsAnswered(Kept(i)) && idles_[i] != kLongIdle;
      if (counts) longest = std::max(longest, idles_[i]);
    }
    return shortest != kLongIdle && shortest > longest ? shortest : Duration();
  }

  /// The cause that was said last; 0: none. All copies share it, as each look is at a copy.
  std::atomic<std::size_t>& said() const { return *said_; }

  /// Words for people that came since the last reply beside which there were none; empty: none.
  const Finding& LatestWords() const { return words_; }

 private:
  static constexpr std::size_t kLong = 256;
  static constexpr Duration kMemory = 2min;
  struct Look {
    Symptom symptom = Symptom::clean;
    Instant at{};
  };

  Symptom At(std::size_t number) const { return latest_[number % kLong].symptom; }
  /// The symptom of the exchange before which the line was silent for idles_[place].
  Symptom Kept(std::size_t place) const { return At(count_ - 1 - (count_ - 1 - place) % kKept); }
  void KeepAround(const Finding& finding) {
    if (finding.symptom != Symptom::few_beside && finding.symptom != Symptom::noise_before &&
        finding.symptom != Symptom::noise_behind && finding.symptom != Symptom::text_beside) {
      return;
    }
    same_around_ = finding.cause == around_ ? same_around_ + 1 : 1;
    around_ = finding.cause;
  }
  void Keep(Finding finding) {
    specials_.Add(finding);
    lengths_.Add(finding);
    KeepAround(finding);
    checks_.Add(finding);
    if (finding.symptom == Symptom::text || finding.symptom == Symptom::text_beside) {
      words_ = finding;
    } else if (IsAnswered(finding.symptom)) {
      words_ = {};
    }
    Finding& last = last_[static_cast<std::size_t>(finding.symptom)];
    const bool others = Count(finding.symptom) > 1;
    if (others) finding.time = std::max(finding.time, last.time);
    last = std::move(finding);
  }

  std::shared_ptr<std::atomic<std::size_t>> said_ = std::make_shared<std::atomic<std::size_t>>(0);
  std::array<Look, kLong> latest_{};
  std::array<Duration, kKept> idles_{};
  std::optional<Duration> shortest_idle_;  // before a request that was answered
  std::size_t count_ = 0;
  ReplyLengths lengths_;
  SpecialBytes specials_;
  Finding words_;
  std::size_t same_around_ = 0;
  std::string around_;
  CheckVotes checks_;
  std::array<Finding, kSymptoms> last_{};
};

}  // namespace baudgate::bus
