// `Probes` decides which offline device or slave is probed next, how much line time probes may
// cost, and how soon the return of a device is noticed. `ProbeBudget` limits the line time of one
// kind of probe. Chooser uses both.
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

// `ProbeBudget` decides when an offline device can be probed. Probes use idle time of the line
// freely. Time that other devices need is used only up to a share, so that offline devices hardly
// delay the others.
class ProbeBudget {
 public:
  static constexpr double kShare = 0.02;
  /// The shortest time between two probes on a line.
  static constexpr Duration kPause = 250ms;

  /// `share`: the part of the time needed by other devices that probes are allowed to use, 0 to 1.
  explicit ProbeBudget(double share = kShare) : share_(share) {}

  /// Returns when a probe can be sent that takes the line at most `worst_cost`; empty: not before
  /// the next exchange. `next_due`: when an answering device needs the line again; empty: none
  /// needs it. `idle_since`: when the line became idle. A probe that delays other devices is sent
  /// only directly after an exchange, because the delay is shortest then.
  std::optional<Instant> NextProbe(Instant now, std::optional<Instant> next_due, Instant idle_since,
                                   Duration worst_cost) const;

  /// A probe used the line from `from` to `to`, and answering devices waited `waited` because of
  /// it.
  void OnProbe(Instant from, Instant to, Duration waited);

  /// Returns when the share allows again a probe that delays other devices.
  Instant earned_at() const { return std::max(pause_until_, share_free_at_); }

  /// Returns the longest time to the next probe after a probe that took `cost` and delayed others
  /// by `waited`.
  static Duration Interval(Duration cost, Duration waited, double share = kShare);

 private:
  double share_;
  Instant pause_until_{};
  Instant share_free_at_{};
};

class Probes {
 public:
  /// A short write of a client (a start or stop) to an offline slave has its own share, because a
  /// slave that is back must get the write before a probe has found the slave. Needed by
  /// PollerRoutedFaults.AWriteReachesAReturnedSlaveBeforeAProbeFindsIt.
  static constexpr double kWriteShare = 0.1;
  /// First looks: if a device has not answered its first request, the request may have been lost.
  /// So its next kFirstLooks probes go before those of other members, and have a larger share for
  /// kFirstTime. Slaves that only routes reach have no first looks, because their clients ask them.
  static constexpr double kFirstShare = 0.2;
  static constexpr int kFirstLooks = 2;
  static constexpr Duration kFirstTime = 10s;
  /// Some devices miss a request that comes too soon after other telegrams. After kHastyLooks
  /// probes without a preceding silence of kRest, the next probe waits for such a silence. If the
  /// polls of other devices leave no silence, the probe delays them as soon as the share allows.
  /// Does not apply to Modbus TCP and to slaves that only routes reach.
  static constexpr Duration kRest = 300ms;
  static constexpr int kHastyLooks = 2;
  /// If the conversation has no request for a probe, it is asked again after this time.
  static constexpr Duration kAskAgain = 1min;

  /// The reason why an offline member is asked. The reason decides which share pays.
  enum class Kind : std::uint8_t { first_look, look, rested_look, short_write };

  struct Facts {
    Instant now{};
    Instant idle_since{};
    std::optional<Instant> next_wanted;  ///< when a member that answers needs the line again
    /// When clients of routes count as gone; empty: there were no clients.
    std::optional<Instant> clients_gone;
    /// Returns true if the return of the member is of interest, so that it is probed.
    std::function<bool(const Member&)> is_looked_for;
    /// Returns true if a client is waiting for an answer of the member.
    std::function<bool(const Member&)> client_waits;
  };

  Probes(const Roster& roster, const LateReplies& late) : roster_(roster), late_(late) {}

  void OnOpened();
  /// The member has gone offline. The costs of its earlier probes no longer count.
  void OnOffline(const Member& member, Instant now) {
    const bool first = member.device != nullptr && member.health.state() == DeviceState::never_seen;
    // The conversation may be able to make a probe now, so it is asked again at once.
    const bool cannot = CannotProbe(member);
    entries_[member] = {.first_looks = first ? kFirstLooks : 0,
                        .first_until = now + kFirstTime,
                        .ask_again = cannot ? std::optional(now) : std::nullopt};
  }
  /// The conversation was asked for a probe. `can`: it has returned a request.
  void OnAsked(const Member& member, bool can, Instant now) {
    entries_[member].ask_again = can ? std::nullopt : std::optional(now + kAskAgain);
  }
  /// True if the member cannot be probed: only a write, or a message sent unasked, can show that it
  /// is back.
  bool CannotProbe(const Member& member) const { return entries_[member].ask_again.has_value(); }

  /// A late reply of the member has come, so its requests do arrive, and first looks are not
  /// needed.
  void OnLate(const Member& member) { entries_[member].first_looks = 0; }

  /// Returns the offline member to probe next. Null: no offline member is of interest, or each has
  /// to wait (ReadyAt).
  Member* Next(const Facts& facts) const;
  /// Returns when Next() is to be probed; empty: not before the next event of the line. The result
  /// can change with each event.
  std::optional<Instant> NextAt(const Facts& facts) const;
  /// The member is probed now. Returns the kind of the probe, which decides which share pays for
  /// it.
  Kind OnTaken(const Member& member, const Facts& facts);
  /// Returns when a short write to this offline member can be sent: in idle time, or as soon as its
  /// share allows, because a client waits for it.
  Instant NextWriteAt(const Member& member, const Facts& facts) const;

  /// The job that probed the member has ended. Its cost is known later, when the line is idle
  /// (OnIdle).
  void NoteEnd(const Member& member, Kind kind, Instant began) { ended_ = {&member, kind, began}; }
  /// Returns when the probe began whose cost is not known yet; empty: there is no such probe.
  std::optional<Instant> began() const;
  /// The line is idle after a probe. `waited`: how long other devices waited because of the probe.
  void OnIdle(Duration waited, Instant now);
  void OnClosed() { ended_ = {}; }

  /// Returns the limit for LineStatus::notice_bound: the time of one turn over all offline members,
  /// plus
  /// * the longest poll period, because a probe that delays other devices is sent only after an
  ///   exchange,
  /// * the time until the share allows the next probe,
  /// * the first looks that remain.
  /// The turn contains for each member the longer of two times: the worst case of its probe plus
  /// kRest and the pause between probes; or the time until the share allows the delay of its last
  /// probe. If the longest measured time between two probes plus the worst case is longer, it is
  /// returned. Empty: no member is offline.
  std::optional<Duration> NoticeBound(Instant now) const;

 private:
  struct Entry {
    std::optional<Duration> waited{};  // how long other devices waited because of the last probe
    std::optional<Instant> probed_at{};
    Duration gap{};  // time between the last two probes
    int first_looks = 0;
    int hasty_looks = 0;    // probes in a row without a silence of kRest before them
    Instant first_until{};  // until then first looks have their larger share
    // Set if the conversation has no request for a probe: when it is asked again.
    std::optional<Instant> ask_again{};
  };
  /// A probe that has ended. Its cost is known when the line is idle again.
  struct Ended {
    const Member* member = nullptr;
    Kind kind = Kind::look;
    Instant began{};
  };

  /// When a member is to be probed, and the kind of the probe.
  struct Look {
    Instant at{};
    Kind kind = Kind::look;
  };

  bool HasFirstLook(const Member& member, Instant now) const;
  /// Returns how the member is to be probed; empty: not before the next exchange.
  std::optional<Look> LookAt(const Member& member, const Facts& facts) const;
  /// Returns when the member can be probed: no late reply can come any more, and its conversation
  /// can be asked for a probe.
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
