// Counts that go on: over roll-overs, over restarts of the module and of this program. A total is
// the sum of the differences between readings of a counter, and begins with what it showed first.
//
//   #010 → >00000005    5              asked twice: an 8-bit sum lets damage through, and a total
//                                      would keep it for ever
//   #010 → >FFFFFFF0    4294967280     the same: each step
//   #010 → >00000010    4294967312     it has rolled over (asked twice, and $AA5 in between)
//   #010 → >00000005    4294967312     it was cleared: it goes on from there
//   $015 → !011, #010 → >00000900      the module was restarted: the same
//
// What cannot be told is in README.md, "Totals".
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "gateway/base/time.h"
#include "protocols/conversation.h"
#include "protocols/dcon/places.h"
#include "protocols/dcon/settings.h"

namespace baudgate::protocols::dcon {

/// "Was there a restart since you were asked last?" Reading it clears the flag.
inline constexpr const char* kAskRestart = "$5";

class Totals {
 public:
  static constexpr Duration kBetweenNotes = 1min;

  /// Both outlive it. `reads`: by point.
  Totals(const Settings& settings, const Probing::Reads& reads);

  bool empty() const { return counters_.empty(); }
  /// `$AA5` is to be asked before `command` goes out.
  bool WantsRestart(std::string_view command) const;
  /// What it said; empty: the module does not know it.
  void OnRestart(std::optional<bool> restarted);
  /// It did not answer that. Twice: it does not know it.
  void OnNothing();
  /// The module may have been restarted: after silence, and when the port was opened again.
  void OnLost() { is_due_ = true; }
  void OnReconnect();
  /// The counter of `#N` was cleared, or another command may have done so.
  void OnCleared(std::string_view command);

  /// Why the count is to be read once more.
  enum class Again : std::uint8_t { no, has_moved, unconfirmed };
  /// Puts totals in place of the counts in `answer`, which is ok. While the count is unconfirmed
  /// there is none in it.
  Again Take(std::string_view command, Answer& answer, Instant now);
  /// Takes them out of an answer that need not be this module's.
  void Leave(Answer& answer) const;

  /// Conversation::Memory: "#0 4294967280 8589934576; #1 5 5", count and total of each. Changes at
  /// most once a minute.
  const std::string& memory() const { return memory_; }
  void Recall(std::string_view memory);

 private:
  struct Seen {
    std::uint64_t count = 0;
    Instant at{};
  };
  struct Counter {
    std::string command;
    std::uint64_t modulus = 0;
    std::optional<std::uint64_t> count;  ///< as it was last believed
    std::optional<Instant> at;           ///< when; empty: before the program began
    std::uint64_t total = 0;
    std::optional<Seen> seen;  ///< the latest one, as long as the next has not confirmed it
    bool begins_anew = false;
  };

  bool IsTotal(const Reading& reading) const;
  Counter* Find(std::string_view command);
  bool CanCount(std::uint64_t step, Duration time) const;
  bool Follows(const Counter& counter, const Seen& seen) const;
  std::uint64_t StepTo(const Counter& counter, const Seen& seen) const;
  bool TakeCount(Counter& counter, const Seen& seen);
  static void BeginAnew(Counter& counter);
  static void Believe(Counter& counter, const Seen& seen, std::uint64_t step);
  void Note(Instant now);

  const Settings& settings_;
  const Probing::Reads& reads_;
  std::vector<Counter> counters_;
  bool is_due_ = true;
  bool context_ = true;  ///< the module answers $AA5
  int silences_ = 0;
  std::string memory_;
  std::optional<Instant> noted_;
};

}  // namespace baudgate::protocols::dcon
