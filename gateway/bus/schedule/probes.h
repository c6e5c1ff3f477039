// Which absent member is probed next, what probes cost the others, and how soon a return is
// noticed. Used by gateway/bus/jobs/chooser.cpp; ProbeBudget decides what a probe may cost.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <functional>
#include <optional>
#include <vector>

#include "gateway/base/time.h"
#include "gateway/bus/devices/roster.h"
#include "gateway/bus/replies/late_replies.h"

namespace baudgate::bus {

// When an absent device may be probed, so that absent devices cost the others next to nothing:
// probes take idle time freely, and at most a capped share of the time that others want.
class ProbeBudget {
 public:
  static constexpr double kShare = 0.02;
  /// The least time between two probes of a line, also of a dead one.
  static constexpr Duration kPause = 250ms;

  /// `share`: the part of the time wanted by living devices that probes may take.
  explicit ProbeBudget(double share = kShare) : share_(share) {}

  /// When a probe that costs the line at most `worst_cost` may be sent. `next_due`: when a living
  /// device wants the line again; empty: no living device does. `idle_since`: when the line
  /// became idle; a probe that will make others wait is sent at that moment only, when it makes
  /// them wait least. Empty: not before the next exchange.
  std::optional<Instant> NextProbe(Instant now, std::optional<Instant> next_due, Instant idle_since,
                                   Duration worst_cost) const;

  /// A probe took the line from `from` to `to`, and living devices waited for it for `waited`.
  void OnProbe(Instant from, Instant to, Duration waited);

  /// When a probe may make others wait again.
  Instant earned_at() const { return std::max(pause_until_, share_free_at_); }

  /// From a probe that took `cost` and made others wait for `waited` to the next one, at most.
  static Duration Interval(Duration cost, Duration waited, double share = kShare);

 private:
  double share_;
  Instant pause_until_{};
  Instant share_free_at_{};  // when the capped share has been earned again
};

class Probes {
 public:
  /// A start or stop that a client sends to an offline slave has a share of its own: a slave that
  /// is back must get it before the probes have found the slave. Needed by
  /// PollerRoutedFaults.AWriteReachesAReturnedSlaveBeforeAProbeFindsIt.
  static constexpr double kWriteShare = 0.1;
  /// A device that has not answered its first request may only have lost it. Its next probes go
  /// before those of other members and have a share of their own, for some seconds. A routed slave
  /// is asked by its clients.
  static constexpr double kFirstShare = 0.2;
  static constexpr int kFirstLooks = 2;
  static constexpr Duration kFirstTime = 10s;
  /// Some devices miss a request that follows other telegrams too soon. After two looks without
  /// such a silence the next one is sent after this long a silence, if possible. If the polls of
  /// others leave no such gap, the look delays them as soon as the share for that is earned. Not on
  /// Modbus TCP, nor for routed slaves.
  static constexpr Duration kRest = 300ms;
  static constexpr int kHastyLooks = 2;
  /// A device that cannot be probed may be able to later, when more is known of it.
  static constexpr Duration kAskAgain = 1min;

  /// Why an offline member is asked.
  enum class Kind : std::uint8_t { first_look, look, rested_look, short_write };

  /// How things are on the line.
  struct Facts {
    Instant now{};
    Instant idle_since{};
    std::optional<Instant> next_wanted;  ///< when a member that answers wants the line again
    std::optional<Instant>
        clients_gone;  ///< when clients of routes count as gone, if there were any
    std::function<bool(const Member&)> is_looked_for;  ///< a return of the member is wanted
    std::function<bool(const Member&)> client_waits;   ///< for an answer of the member, now
  };

  Probes(const Roster& roster, const LateReplies& late) : roster_(roster), late_(late) {}

  void OnOpened();
  /// It has just gone offline: what its earlier probes cost no longer counts.
  void OnOffline(const Member& member, Instant now) {
    const bool first = member.device != nullptr && member.health.state() == DeviceState::never_seen;
    const bool cannot = CannotProbe(member);  // so far: what it was asked may be known again
    entries_[member] = {.first_looks = first ? kFirstLooks : 0,
                        .first_until = now + kFirstTime,
                        .ask_again = cannot ? std::optional(now) : std::nullopt};
  }
  /// Whether its conversation has a request for a probe: `can` is what it has just said.
  void OnAsked(const Member& member, bool can, Instant now) {
    entries_[member].ask_again = can ? std::nullopt : std::optional(now + kAskAgain);
  }
  /// Only a write, or what it sends unasked, can show that it is there.
  bool CannotProbe(const Member& member) const { return entries_[member].ask_again.has_value(); }

  /// A late reply of it has come: its requests are not lost.
  void OnLate(const Member& member) { entries_[member].first_looks = 0; }

  /// The member to probe next, if there is time. Null: no offline member is wanted, or a late reply
  /// of each may still come.
  Member* Next(const Facts& facts) const;
  /// When; may change with anything that happens on the line.
  std::optional<Instant> NextAt(const Facts& facts) const;
  /// It is probed now; on which share that counts.
  Kind OnTaken(const Member& member, const Facts& facts);
  /// When a short write may be tried at this member: as soon as its share allows, even if others
  /// wait, because its client waits for nothing else.
  Instant NextWriteAt(const Member& member, const Facts& facts) const;

  /// The task that probed it has ended; the line may not be idle yet.
  void NoteEnd(const Member& member, Kind kind, Instant began) { ended_ = {&member, kind, began}; }
  /// Since when a probe has kept the line from being idle; empty: none does.
  std::optional<Instant> began() const;
  /// The line is idle again; `waited`: how long others waited for it.
  void OnIdle(Duration waited, Instant now);
  void OnClosed() { ended_ = {}; }

  /// See LineStatus::notice_bound. One turn of all offline members. Each adds the longer of: its
  /// worst case plus kRest and the pause between probes; or the time needed to earn what its last
  /// probe cost the others. To the turn add the longest poll period (a probe that delays others is
  /// sent only after an exchange), the time until a used-up share is earned, and the first looks
  /// that are still to come. If the longest gap measured between two probes plus the worst case is
  /// longer, that counts.
  std::optional<Duration> NoticeBound(Instant now) const;

 private:
  struct Entry {
    std::optional<Duration> waited{};    // how long others waited for its last probe
    std::optional<Instant> probed_at{};  // when that was sent
    Duration gap{};                      // since the one before
    int first_looks = 0;                 // that it still has
    int hasty_looks = 0;                 // since the latest behind a pause
    Instant first_until{};               // how long it has them
    std::optional<Instant> ask_again{};  // it cannot be probed; when that is tried again
  };
  /// A probe whose cost is known once the line is idle again.
  struct Ended {
    const Member* member = nullptr;
    Kind kind = Kind::look;
    Instant began{};
  };

  /// When a member may be probed, and on which share.
  struct Look {
    Instant at{};
    Kind kind = Kind::look;
  };

  bool HasFirstLook(const Member& member, Instant now) const;
  /// Empty: not before the next exchange.
  std::optional<Look> LookAt(const Member& member, const Facts& facts) const;
  /// When it may be probed: no late reply can come, and its conversation may have a request.
  Instant ReadyAt(const Member& member) const;
  ProbeBudget& BudgetOf(Kind kind);

  const Roster& roster_;
  const LateReplies& late_;
  ByMember<Entry> entries_;
  ProbeBudget first_looks_{kFirstShare};
  ProbeBudget looks_;
  ProbeBudget writes_{kWriteShare};
  Ended ended_;
  std::size_t turn_ = 0;
};

}  // namespace baudgate::bus
