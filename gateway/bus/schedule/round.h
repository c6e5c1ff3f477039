// The queries of one group of one device, on the fixed grid of the group's period. A part of
// gateway/bus/schedule/schedule.h.
//
//   due at 10 s, period 5 s
//   begun at 11 s    the next round is due at 15 s
//   begun at 22 s    two periods have passed whole: missed 2, the next round is due at 25 s
//
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <utility>
#include <vector>

#include "config/model/point.h"
#include "gateway/base/time.h"

namespace baudgate {

struct Round {
  static constexpr Duration kSoonest = config::kAgainPeriod;

  std::vector<std::size_t> queries{};
  Duration period{};                 ///< zero: once
  std::optional<Instant> due{};      ///< start of the next round; empty: none
  std::size_t cursor = 0;            ///< next query; queries.size(): no round in progress
  std::uint64_t turn = 0;            ///< when it was last served, counted in picks
  bool due_early = false;            ///< due earlier than by its period
  bool repeats_soon = false;         ///< RepeatSoon was called since the round began
  Duration soon = kSoonest;          ///< the wait of the next RepeatSoon
  bool blocked = false;              ///< never due
  std::optional<Instant> planned{};  ///< blocked: when it would be due
  struct Before {
    std::size_t queries = 0;
    std::size_t next = 0;  ///< to go on with: the one after the latest, or the latest itself
    std::optional<Instant> due{};
    bool active = false;
    bool asked = false;  ///< the latest request was one of its queries
  };
  Before before{};  ///< the latest change of its queries

  bool active() const { return cursor < queries.size(); }
  /// The round in progress ends.
  void Stop() { cursor = queries.size(); }

  /// Its queries are about to change. `asked`: see Before.
  void Remember(bool asked) {
    before = {.queries = queries.size(),
              .next = cursor - (asked && cursor > 0 ? 1 : 0),
              .due = due,
              .active = active(),
              .asked = asked};
  }
  /// Nothing of it is due until Schedule::ReleaseEvents.
  void Block() {
    if (!blocked) planned = active() ? Instant{} : due;
    blocked = true;
    due.reset();
    Stop();
  }
  /// Due at once, unless it is blocked.
  void Restart(Instant now) {
    if (!blocked) due = now;
    due_early = repeats_soon = false;
    soon = kSoonest;
    Stop();
  }
  /// Due at `at`, if that is earlier; once until it begins.
  void Repeat(Instant at) {
    if (due_early || (due && *due <= at)) return;
    due = at;
    due_early = true;
  }

  /// Due early, with back-off: after 8 s, then 16 s, 32 s … at most `most`, as long as each round
  /// in a row calls this. Further calls in the same round do nothing.
  void RepeatSoon(Instant now, Duration most) {
    if (std::exchange(repeats_soon, true)) return;
    Repeat(now + std::min(soon, most));
    soon = std::min(2 * soon, most);
  }

  /// Periods that have passed whole since it was due.
  std::uint32_t Passed(Instant now) const {
    if (!due || *due > now || period == Duration::zero()) return 0;
    return static_cast<std::uint32_t>((now - *due) / period);
  }
  /// Begins if it is due; returns the periods that are skipped by that.
  std::uint32_t StartIfDue(Instant now) {
    if (active() || queries.empty() || !due || *due > now) return 0;
    due_early = false;
    if (!std::exchange(repeats_soon, false)) soon = kSoonest;
    cursor = 0;
    if (period == Duration::zero()) {
      due.reset();
      return 0;
    }
    const std::uint32_t passed = Passed(now);
    *due += (std::int64_t{passed} + 1) * period;
    return passed;
  }
};

}  // namespace baudgate
