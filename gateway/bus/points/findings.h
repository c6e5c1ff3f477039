// `Findings` stores what the latest exchanges of a device looked like on the wire (`Finding`), for
// the diagnosis. The last 32 exchanges show the present condition; the last 32 failures of two
// minutes show the kind of failures, and keep the diagnosis from changing with each exchange.
// `CheckVotes`, `ReplyLengths` and `SpecialBytes` each collect one property. Memory is bounded.
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

// `CheckVotes` finds out whether most wrong check values (checksums) would be right if they were
// computed in one other way (Finding::remedy). A single check value that was damaged on the wire
// can fit another way by chance, so a way must win by several votes.
class CheckVotes {
 public:
  void Add(const Finding& finding) {
    if (finding.symptom != Symptom::bad_check || finding.remedy.empty()) return;
    const bool same = finding.remedy == most_.remedy;
    votes_ = std::min(votes_ + (same ? 1 : -1), 2 * kNoChance);
    if (votes_ > 0) return;
    most_ = finding;
    votes_ = 1;
  }
  /// Returns a finding with the remedy that fits most wrong check values. Null: no remedy does.
  const Finding* winner() const { return votes_ >= kNoChance ? &most_ : nullptr; }

 private:
  static constexpr int kNoChance = 4;

  Finding most_;
  int votes_ = 0;
};

// `ReplyLengths` finds out up to which length the replies of a device come complete. Example:
//
//   replies of 7, 7, 49 (damaged), 7, 49 (damaged) bytes: the longest good reply has 7 bytes, and
//   two damaged replies are longer
class ReplyLengths {
 public:
  /// Failed replies that were longer than any good reply: the shortest length, and their number.
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
  /// Returns the expected lengths of replies that did not come at all and are longer than any good
  /// reply.
  const TooLong& silent() const { return silent_; }
  /// Returns the lengths of replies that came damaged and are longer than any good reply.
  const TooLong& damaged() const { return damaged_; }

 private:
  /// After so many damaged replies of lengths that were good before, without a complete reply of
  /// such a length between them, these lengths count as too long.
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
    // Replies of this length were complete before, but are not any more.
    longest_good_ = good_since_;
    damaged_ = std::exchange(again_, {});
  }

  std::size_t longest_good_ = 0;
  TooLong silent_;
  TooLong damaged_;
  TooLong again_;               // damaged replies of lengths that were good before
  std::size_t good_since_ = 0;  // length of the longest good reply since `again_` began
};

// `SpecialBytes` compares the bytes of failed and of good replies. Converters may change or drop
// certain bytes (kSpecialBytes). A byte is suspect if all failed replies contain it and no good
// reply does.
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

  /// Returns the suspect bytes: every failed reply contained them, and no good reply did. One bit
  /// for each byte of kSpecialBytes.
  std::uint8_t Suspects() const {
    if (!any_bad_) return 0;
    return static_cast<std::uint8_t>(bad_ & ~good_ & kAllSpecials);
  }
  /// Returns which of kSpecialBytes were in an answered request, one bit each.
  std::uint8_t AnsweredRequests() const { return asked_; }
  /// True if the failed replies contained bytes of one parity only, and FF. The gateway replaces a
  /// character with wrong parity by FF (kDamaged in transports/parity.h), so the configured parity
  /// is wrong.
  bool IsOneParity() const {
    constexpr unsigned kMark = 1U << (std::size(kSpecialBytes) - 1);
    return (any_ & kMark) != 0 && LacksOneParity();
  }
  /// True if the failed replies contained bytes of one parity only, with or without FF. Behind a
  /// serial server there is no FF, because the server drops bytes with wrong parity.
  bool LacksOneParity() const {
    const unsigned parities = any_ & kBothParities;
    return any_bad_ && (parities == kEvenByte || parities == kOddByte);
  }
  /// True if no received byte had its eighth bit set, although the protocol uses this bit, and the
  /// failed replies contained bytes of both parities.
  bool IsSevenBit() const {
    return any_bad_ && !any_high_ && (any_ & kBothParities) == kBothParities;
  }

 private:
  static constexpr unsigned kBothParities = kEvenByte | kOddByte;

  std::uint8_t asked_ = 0;   // bits of Finding::asked in any answered request
  std::uint8_t good_ = 0;    // bits of Finding::specials in any good reply
  std::uint8_t bad_ = 0xFF;  // bits of Finding::specials in every failed reply
  std::uint8_t any_ = 0;     // bits of Finding::specials in any failed reply
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
  /// Replaces the symptom of an earlier exchange, because late bytes have changed it. `back`: 0 for
  /// the last exchange, 1 for the exchange before it.
  void Amend(Finding finding, std::size_t back = 0) {
    if (back >= size()) return;
    latest_[(count_ - 1 - back) % kLong].symptom = finding.symptom;
    Keep(std::move(finding));
  }

  std::size_t size() const { return std::min(count_, kKept); }
  std::size_t Count(Symptom symptom) const {
    std::size_t count = 0;
    for (std::size_t i = count_ - size(); i < count_; ++i) count += At(i) == symptom ? 1 : 0;
    return count;
  }
  /// Returns how often each symptom occurs among the last kKept failures. Failures before the last
  /// kLong exchanges, or more than kMemory older than the latest exchange, are not counted.
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
  /// Returns how often the device has restarted. A restart is a text directly after silence,
  /// followed by an answer. Zero if more than half of the texts belong to no restart.
  std::size_t Starts() const {
    const auto is_text = [](Symptom symptom) {
      return symptom == Symptom::text || symptom == Symptom::text_beside;
    };
    std::size_t starts = 0;
    std::size_t texts = 0;
    bool open = false;  // a text has come after silence, but no answer yet
    for (std::size_t i = count_ - std::min(count_, kLong); i < count_; ++i) {
      const bool is_first = i > 0 && At(i - 1) == Symptom::silence && is_text(At(i));
      texts += is_text(At(i)) ? 1 : 0;
      open = open || is_first;
      starts += open && IsAnswered(At(i)) ? 1 : 0;
      open = open && !IsAnswered(At(i));
    }
    return 2 * starts >= texts ? starts : 0;
  }
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
  std::size_t LongestRun() const {
    std::size_t longest = 0;
    std::size_t run = 0;
    for (std::size_t i = count_ - size(); i < count_; ++i) {
      run = IsAnswered(At(i)) ? 0 : run + 1;
      longest = std::max(longest, run);
    }
    return longest;
  }
  /// Returns the last finding with this symptom; empty: there was none. Its `time` is the longest
  /// of all findings with this symptom.
  const Finding& Last(Symptom symptom) const { return last_[static_cast<std::size_t>(symptom)]; }

  const SpecialBytes& specials() const { return specials_; }
  const ReplyLengths& lengths() const { return lengths_; }

  /// For replies with stray bytes before or behind them: SameAround returns how many such replies
  /// in a row had the same stray bytes, and Around returns these bytes.
  std::size_t SameAround() const { return same_around_; }
  const std::string& Around() const { return around_; }

  /// Returns a finding whose remedy says how most wrong check values are computed (CheckVotes).
  /// Null: no such way was found.
  const Finding* Check() const { return checks_.winner(); }

  /// For messages that come without a request, in bursts: returns the shortest and the longest
  /// silence between two bursts. Silences below a quarter of `least` are within a burst. Empty: no
  /// burst was found, or a silence was between a quarter of `least` and `least`.
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

  /// Returns the longest silence before a request without any answer, if the silence before every
  /// answered request was longer: the device may need a longer pause. Else zero.
  Duration ShortPause() const {
    Duration longest{};
    for (std::size_t i = 0; i < size(); ++i) {
      if (Kept(i) == Symptom::silence) longest = std::max(longest, idles_[i]);
    }
    return shortest_idle_ && *shortest_idle_ > longest ? longest : Duration();
  }

  /// Returns the shortest silence before an answered request. Empty: no request was answered, or
  /// the silences are unknown.
  std::optional<Duration> ShortestAnswered() const {
    return shortest_idle_ == kLongIdle ? std::nullopt : shortest_idle_;
  }

  /// Returns the shortest silence before a request without any answer, if the silence before all
  /// recent answered requests was shorter: the device may fall asleep. Else zero.
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

  /// Number of the cause that the diagnosis has reported last; 0: none. All copies of this object
  /// share the number, because each diagnosis reads a copy.
  std::atomic<std::size_t>& said() const { return *said_; }

  /// Returns the finding with the latest readable text, if no reply without text has come since;
  /// else an empty finding.
  const Finding& LatestWords() const { return words_; }

 private:
  static constexpr std::size_t kLong = 256;
  static constexpr Duration kMemory = 2min;
  struct Look {
    Symptom symptom = Symptom::clean;
    Instant at{};
  };

  Symptom At(std::size_t number) const { return latest_[number % kLong].symptom; }
  /// Returns the symptom of the exchange before which the line was silent for idles_[place].
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
  std::optional<Duration> shortest_idle_;
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
