// Totals adds up the counts of counters over roll-overs and over restarts of the module and of this
// program. A total is the sum of the differences between readings; it begins with the first
// reading. Each changed count is read twice, because a damaged count that passes the 8-bit checksum
// would stay in the total for ever.
//
//   reply to #010    total
//   >00000005        5
//   >FFFFFFF0        4294967280
//   >00000010        4294967312     roll-over: $AA5 is asked between the two readings
//   >00000005        4294967312     the counter was cleared: the total counts on from here
//   >00000900        4294967312     after $015 → !011 (the module was restarted): as after a clear
//
// protocols/dcon/README.md, "Totals", lists the cases that cannot be distinguished.
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

/// The command `$AA5` asks whether the module was restarted since the last `$AA5`. The module
/// clears its restart flag when it answers.
inline constexpr const char* kAskRestart = "$5";

class Totals {
 public:
  static constexpr Duration kBetweenNotes = 1min;

  /// `reads` is indexed by point. `settings` and `reads` must outlive this object.
  Totals(const Settings& settings, const Probing::Reads& reads);

  bool empty() const { return counters_.empty(); }
  /// True if `$AA5` must be asked before `command` is sent.
  bool WantsRestart(std::string_view command) const;
  /// Call it with the reply to `$AA5`. An empty `restarted` means that the module refuses `$AA5`,
  /// so it is not asked again.
  void OnRestart(std::optional<bool> restarted);
  /// Call it if `$AA5` was not answered. After two failures in a row the command counts as
  /// unsupported.
  void OnNothing();
  /// Call it after silence, because the module may have been restarted: `$AA5` is then asked again.
  void OnLost() { is_due_ = true; }
  void OnReconnect();
  /// Call it if the counter that `command` ("#0") reads was cleared, or may have been cleared.
  void OnCleared(std::string_view command);

  /// The reason why a counter must be read again at once: its count has changed, or is not
  /// confirmed yet.
  enum class Again : std::uint8_t { no, has_moved, unconfirmed };
  /// Replaces the counts in `answer` (outcome ok) by totals, or removes them as long as they are
  /// unconfirmed.
  Again Take(std::string_view command, Answer& answer, Instant now);
  /// Removes the totals from an answer that may come from another module.
  void Leave(Answer& answer) const;

  /// Returns the text for Conversation::Memory: command, count and total of each counter, such as
  /// "#0 4294967280 8589934576; #1 5 5". It changes at most once a minute.
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
    /// The last confirmed count; empty: no count was confirmed yet.
    std::optional<std::uint64_t> count;
    std::optional<Instant> at;
    std::uint64_t total = 0;
    std::optional<Seen> seen;
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
  /// True: the module supports `$AA5`, or has neither refused it nor ignored it twice in a row.
  bool context_ = true;
  int silences_ = 0;
  std::string memory_;
  std::optional<Instant> noted_;
};

}  // namespace baudgate::protocols::dcon
