// `Probes` decides which absent member is probed next, how much line time probes may cost, and how
// soon a return is noticed. `ProbeBudget` is the limit for one kind of probe. Used by
// gateway/bus/jobs/chooser.cpp.
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

// `ProbeBudget` decides when an absent device may be probed, so that absent devices hardly delay
// the others: probes use idle time freely, and at most a limited share of the time that other
// devices want.
class ProbeBudget {
 public:
  static constexpr double kShare = 0.02;
  /// The shortest time between two probes of a line, even if no device answers.
  static constexpr Duration kPause = 250ms;

  /// `share`: the part of the time wanted by living devices that probes may use.
  explicit ProbeBudget(double share = kShare) : share_(share) {}

  /// Returns when a probe may be sent that costs the line at most `worst_cost`. `next_due`: when a
  /// living device wants the line again; empty: no living device wants it. `idle_since`: when the
  /// line became idle. A probe that delays other devices is sent only at that moment, because the
  /// delay is shortest then. Empty: not before the next exchange.
  std::optional<Instant> NextProbe(Instant now, std::optional<Instant> next_due, Instant idle_since,
                                   Duration worst_cost) const;

  /// A probe used the line from `from` to `to`, and living devices waited for it for `waited`.
  void OnProbe(Instant from, Instant to, Duration waited);

  /// Returns when a probe may delay other devices again.
  Instant earned_at() const { return std::max(pause_until_, share_free_at_); }

  /// Returns the longest time from a probe that took `cost` and delayed others by `waited` to the
  /// next probe.
  static Duration Interval(Duration cost, Duration waited, double share = kShare);

 private:
  double share_;
  Instant pause_until_{};
  Instant share_free_at_{};
};

class Probes {
 public:
  /// A short write of a client (a start or stop) to an offline slave has a share of its own: a
  /// slave that is back must get the write before the probes have found the slave. Needed by
  /// PollerRoutedFaults.AWriteReachesAReturnedSlaveBeforeAProbeFindsIt.
  static constexpr double kWriteShare = 0.1;
  /// A device that has not answered its first request may only have lost it. Its next probes go
  /// before those of other members, and have a share of their own for some seconds. This does not
  /// apply to routed slaves, because their clients ask them.
  static constexpr double kFirstShare = 0.2;
  static constexpr int kFirstLooks = 2;
  static constexpr Duration kFirstTime = 10s;
  /// Some devices miss a request that follows other telegrams too soon. After two probes without
  /// such a silence the next probe waits for a silence of kRest, if possible. If the polls of other
  /// devices leave no such gap, the probe delays them as soon as the share for that is earned. Not
  /// on Modbus TCP, and not for routed slaves.
  static constexpr Duration kRest = 300ms;
  static constexpr int kHastyLooks = 2;
  /// A device that cannot be probed may be probed later, when its conversation has learned more.
  static constexpr Duration kAskAgain = 1min;

  /// Why an offline member is asked.
  enum class Kind : std::uint8_t { first_look, look, rested_look, short_write };

  struct Facts {
    Instant now{};
    Instant idle_since{};
    std::optional<Instant> next_wanted;  ///< when a member that answers wants the line again
    /// When clients of routes count as gone; empty: there were no clients.
    std::optional<Instant> clients_gone;
    /// Returns whether the return of the member is wanted.
    std::function<bool(const Member&)> is_looked_for;
    /// Returns whether a client waits now for an answer of the member.
    std::function<bool(const Member&)> client_waits;
  };

  Probes(const Roster& roster, const LateReplies& late) : roster_(roster), late_(late) {}

  void OnOpened();
  /// The member has just gone offline: the cost of its earlier probes no longer counts.
  void OnOffline(const Member& member, Instant now) {
    const bool first = member.device != nullptr && member.health.state() == DeviceState::never_seen;
    // Ask at once again: the conversation may have a request for a probe now.
    const bool cannot = CannotProbe(member);
    entries_[member] = {.first_looks = first ? kFirstLooks : 0,
                        .first_until = now + kFirstTime,
                        .ask_again = cannot ? std::optional(now) : std::nullopt};
  }
  /// The conversation was asked for a probe. `can`: it had a request.
  void OnAsked(const Member& member, bool can, Instant now) {
    entries_[member].ask_again = can ? std::nullopt : std::optional(now + kAskAgain);
  }
  /// Returns true if only a write, or a message sent unasked, can show that the member is there.
  bool CannotProbe(const Member& member) const { return entries_[member].ask_again.has_value(); }

  /// A late reply of the member has come, so its requests are not lost.
  void OnLate(const Member& member) { entries_[member].first_looks = 0; }

  /// Returns the member to probe next, if there is time. Null: no offline member is wanted, or a
  /// late reply of each may still come.
  Member* Next(const Facts& facts) const;
  /// Returns when to probe Next(). The result may change with each event of the line.
  std::optional<Instant> NextAt(const Facts& facts) const;
  /// The member is probed now. Returns which share pays for the probe.
  Kind OnTaken(const Member& member, const Facts& facts);
  /// Returns when a short write to this member may be tried: as soon as its share allows, even if
  /// other devices have to wait, because its client waits for nothing else.
  Instant NextWriteAt(const Member& member, const Facts& facts) const;

  /// The task that probed the member has ended; the line may not be idle yet.
  void NoteEnd(const Member& member, Kind kind, Instant began) { ended_ = {&member, kind, began}; }
  /// Returns since when a probe has kept the line busy; empty: no probe does.
  std::optional<Instant> began() const;
  /// The line is idle again. `waited`: how long other devices waited for it.
  void OnIdle(Duration waited, Instant now);
  void OnClosed() { ended_ = {}; }

  /// Returns the limit for LineStatus::notice_bound: the time of one turn over all offline members,
  /// and
  /// * the longest poll period, because a probe that delays other devices is sent only after an
  ///   exchange,
  /// * the time until a used-up share is earned,
  /// * the first looks that are still to come.
  /// Each member adds the longer of two times to the turn: its worst case plus kRest and the pause
  /// between probes; or the time to earn the delay of its last probe. If the longest measured gap
  /// between two probes plus the worst case is longer, that is returned.
  std::optional<Duration> NoticeBound(Instant now) const;

 private:
  struct Entry {
    std::optional<Duration> waited{};  // how long other devices waited for the last probe
    std::optional<Instant> probed_at{};
    Duration gap{};  // time between the last two probes
    int first_looks = 0;
    int hasty_looks = 0;    // number of probes since the last probe after a pause
    Instant first_until{};  // until when the first looks may be used
    // Set if the member cannot be probed: when to try that again.
    std::optional<Instant> ask_again{};
  };
  /// A probe whose cost is known when the line is idle again.
  struct Ended {
    const Member* member = nullptr;
    Kind kind = Kind::look;
    Instant began{};
  };

  /// When a member may be probed, and which share pays for it.
  struct Look {
    Instant at{};
    Kind kind = Kind::look;
  };

  bool HasFirstLook(const Member& member, Instant now) const;
  /// Empty: not before the next exchange.
  std::optional<Look> LookAt(const Member& member, const Facts& facts) const;
  /// Returns when the member may be probed: no late reply can come, and its conversation may have a
  /// request.
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
