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

// `ProbeBudget` decides when an offline device can be probed. In idle time of the line probes are
// free. A probe that makes answering devices wait is sent so rarely that they wait for at most a
// share of the time.
class ProbeBudget {
 public:
  static constexpr double kShare = 0.02;
  /// The shortest time from the end of a probe to the next probe of this budget.
  static constexpr Duration kPause = 250ms;

  /// `share`: the part of the time in which answering devices may wait because of probes, 0 to 1.
  explicit ProbeBudget(double share = kShare) : share_(share) {}

  /// Returns when a probe can be sent that takes the line at most `worst_cost`; empty: not before
  /// the next exchange. `next_due`: when an answering device needs the line again; empty: none
  /// needs it. `idle_since`: when the line became idle. A probe that delays other devices is sent
  /// only directly after an exchange, because the delay is shortest then.
  std::optional<Instant> NextProbe(Instant now, std::optional<Instant> next_due, Instant idle_since,
                                   Duration worst_cost) const;

  /// Call when a probe has used the line from `from` to `to`. `waited`: how long answering devices
  /// waited because of it.
  void OnProbe(Instant from, Instant to, Duration waited);

  /// Returns from when on a probe may delay other devices again.
  Instant earned_at() const { return std::max(pause_until_, share_free_at_); }

  /// Returns the longest time from the start of a probe to the next probe, if the probe takes
  /// `cost` and makes other devices wait for `waited`.
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
  /// First looks are the next kFirstLooks probes of a device that has not answered its first
  /// request, because the request may have been lost. They go before probes of other members, and
  /// have a larger share for kFirstTime. Slaves without configuration have no first looks, because
  /// their clients ask them.
  static constexpr double kFirstShare = 0.2;
  static constexpr int kFirstLooks = 2;
  static constexpr Duration kFirstTime = 10s;
  /// Some devices miss a request that comes too soon after other telegrams. After kHastyLooks
  /// probes without a preceding silence of kRest, the next probe waits for such a silence. If the
  /// polls of other devices leave no silence, the probe delays them as soon as kShare allows. Does
  /// not apply to Modbus TCP and to slaves without configuration.
  static constexpr Duration kRest = 300ms;
  static constexpr int kHastyLooks = 2;
  /// If the conversation (protocols/conversation.h) has no request for a probe, it is asked again
  /// after this time.
  static constexpr Duration kAskAgain = 1min;

  /// Why an offline member is asked. The kind decides which ProbeBudget limits the probe.
  enum class Kind : std::uint8_t { first_look, look, rested_look, short_write };

  struct Facts {
    Instant now{};
    Instant idle_since{};
    std::optional<Instant> next_wanted;  ///< when a member that answers needs the line again
    /// When clients of transparent routes count as gone (RoutedSide); empty: there were no clients.
    std::optional<Instant> clients_gone;
    /// Returns true if the member is to be probed, so that its return is noticed.
    std::function<bool(const Member&)> is_looked_for;
    std::function<bool(const Member&)> client_waits;
  };

  Probes(const Roster& roster, const LateReplies& late) : roster_(roster), late_(late) {}

  void OnOpened();
  /// Call when the member has gone offline. Forgets the costs of its earlier probes.
  void OnOffline(const Member& member, Instant now) {
    const bool first = member.device != nullptr && member.health.state() == DeviceState::never_seen;
    // The conversation may be able to make a probe now, so it is asked again at once.
    const bool cannot = CannotProbe(member);
    entries_[member] = {.first_looks = first ? kFirstLooks : 0,
                        .first_until = now + kFirstTime,
                        .ask_again = cannot ? std::optional(now) : std::nullopt};
  }
  /// Call when the conversation was asked for a probe. `can`: it has returned a request.
  void OnAsked(const Member& member, bool can, Instant now) {
    entries_[member].ask_again = can ? std::nullopt : std::optional(now + kAskAgain);
  }
  /// True if the member cannot be probed: only a write, or a message that it sends without being
  /// asked, can show that it is back.
  bool CannotProbe(const Member& member) const { return entries_[member].ask_again.has_value(); }

  /// Call when a late reply of the member has come. Its requests do arrive, so first looks are not
  /// needed.
  void OnLate(const Member& member) { entries_[member].first_looks = 0; }

  /// Returns the offline member to probe next. Null: none is to be probed (is_looked_for), or each
  /// has to wait (ReadyAt).
  Member* Next(const Facts& facts) const;
  /// Returns when Next() is to be probed; empty: not before the next event of the line. The result
  /// can change with each event.
  std::optional<Instant> NextAt(const Facts& facts) const;
  /// Call when the member is probed. Returns the kind of the probe.
  Kind OnTaken(const Member& member, const Facts& facts);
  /// Returns when a short write to this offline member can be sent: in idle time, or as soon as
  /// kWriteShare allows that other devices wait.
  Instant NextWriteAt(const Member& member, const Facts& facts) const;

  /// Call when the job that has probed the member has ended. How long other devices waited is known
  /// later (OnIdle).
  void NoteEnd(const Member& member, Kind kind, Instant began) { ended_ = {&member, kind, began}; }
  /// Returns when the last probe began; empty: OnIdle has been called since, or there was no probe.
  std::optional<Instant> began() const;
  /// Call when the line is idle after a probe. `waited`: how long other devices waited because of
  /// the probe.
  void OnIdle(Duration waited, Instant now);
  void OnClosed() { ended_ = {}; }

  /// Returns LineStatus::notice_bound, the longest time until the return of an offline member is
  /// noticed. It is the sum of
  /// * the first looks that remain,
  /// * the time until kShare allows the next probe,
  /// * one turn, in which each offline member is probed once,
  /// * the longest poll period, because a probe that delays other devices is sent only after an
  ///   exchange.
  ///
  /// For each member the turn contains the longer of two times: the worst case of its probe plus
  /// kRest and ProbeBudget::kPause; or the time until kShare allows the delay of its last probe. If
  /// the longest measured time between two probes plus the worst case is longer than the sum, it is
  /// returned. Empty: no member is offline.
  std::optional<Duration> NoticeBound(Instant now) const;

 private:
  struct Entry {
    std::optional<Duration> waited{};  // how long other devices waited because of the last probe
    std::optional<Instant> probed_at{};
    Duration gap{};  // time between the last two probes
    int first_looks = 0;
    int hasty_looks = 0;    // probes in a row without a silence of kRest before them
    Instant first_until{};  // first looks have their larger share until this time
    // Set if the conversation has no request for a probe: when it is asked again.
    std::optional<Instant> ask_again{};
  };
  struct Ended {
    const Member* member = nullptr;
    Kind kind = Kind::look;
    Instant began{};
  };

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
