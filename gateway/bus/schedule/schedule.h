// The schedule of a line: which device is due (`Round`, `Schedule`), how long the line may still be
// used by reads that can wait (`Background`), and whose turn it is (`Turns`). README.md has the
// rules and a diagram of the shares. No input, output or clock: the time is an argument.
// gateway/bus/jobs/chooser.cpp asks whenever the line is idle.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <optional>
#include <utility>
#include <vector>

#include "config/model/point.h"
#include "gateway/base/time.h"

namespace baudgate::bus {

// The queries of one group of one device. README.md has an example.
struct Round {
  static constexpr Duration kSoonest = config::kAgainPeriod;
  std::vector<std::size_t> queries{};
  Duration period{};  ///< time between the starts of two rounds; zero: the group is read once
  std::optional<Instant> due{};  ///< start of the next round; empty: none
  std::size_t cursor = 0;        ///< next query; queries.size(): no round in progress
  std::uint64_t turn = 0;        ///< when the round was last served, counted in picks
  bool due_early = false;        ///< the round is due earlier than by its period
  bool repeats_soon = false;     ///< RepeatSoon was called since the round began
  Duration soon = kSoonest;      ///< the wait of the next RepeatSoon

  bool active() const { return cursor < queries.size(); }
  void Stop() { cursor = queries.size(); }
  void Repeat(Instant at) {
    if (due_early || (due && *due <= at)) return;
    due = at;
    due_early = true;
  }
  /// Returns the number of whole periods that have passed since the round was due.
  std::uint32_t Passed(Instant now) const {
    if (active() || queries.empty() || !HasCome(due, now) || period == 0s) return 0;
    return static_cast<std::uint32_t>((now - *due) / period);
  }
  /// Begins the round if it is due. Returns the number of periods that are skipped.
  std::uint32_t StartIfDue(Instant now) {
    if (active() || queries.empty() || !HasCome(due, now)) return 0;
    const std::uint32_t passed = Passed(now);
    cursor = 0;
    due_early = false;
    if (!std::exchange(repeats_soon, false)) soon = kSoonest;
    due = period == 0s ? std::nullopt : std::optional(*due + (std::int64_t{passed} + 1) * period);
    return passed;
  }
  /// Continues the round `before`, whose queries have changed. Example: two of four queries were
  /// asked, and one of these two is gone: one of three was asked, two are left. If there are more
  /// queries than before, the new ones are unknown, so the round begins again.
  void GoOnAfter(const Round& before) {
    const std::size_t left = before.queries.size() - before.cursor;
    cursor = queries.size() - std::min(left, queries.size());
    if (queries.size() > before.queries.size()) cursor = 0;
  }
};

/// In place of the number of a query: the events of the device.
inline constexpr std::size_t kEventsQuery = std::numeric_limits<std::size_t>::max();

// `Schedule` decides which query of which device is next. A group that is due starts a round over
// its queries. The rounds of the device that has used the line least continue, in turn.
class Schedule {
 public:
  struct Pick {
    std::size_t device = 0;
    std::size_t query = 0;  ///< number of the query, or kEventsQuery
    config::Group group = config::Group::fast;
    bool last_of_round = false;
  };

  /// Adds a device without queries (see SetQueries). Devices are numbered from 0. `intervals`:
  /// periods of the groups from config::Group::own on.
  std::size_t AddDevice(Duration fast_period, Duration slow_period,
                        Duration daily_period = std::chrono::hours(24),
                        const std::vector<Duration>& intervals = {});

  /// Sets the groups of the queries, in the order of asking. Rounds under way end; unless the
  /// device is suspended, call a restart or GoOn next. `events`: the device is asked for events as
  /// often as for the fast group.
  void SetQueries(std::size_t device, const std::vector<config::Group>& groups,
                  bool events = false);
  /// Call after SetQueries. Rounds under way continue with the query that replaces their next
  /// query; other rounds keep their time. With a restart in place of this, each of a hundred
  /// refusals would restart all rounds.
  void GoOn(std::size_t device, Instant now);
  /// Makes all groups due at once, or at the end of a hold: the port opened, or the device came
  /// back.
  void Restart(std::size_t device, Instant now);
  /// As Restart, after SetQueries, but a daily round under way continues.
  void RestartAsPlanned(std::size_t device, Instant now);
  /// No query of the device is due until Restart, because it is offline or disabled.
  void Suspend(std::size_t device);

  /// The device is not asked for events until ReleaseEvents, because the last events are not on the
  /// disk yet.
  void HoldEvents(std::size_t device);
  /// The events are on the disk. README.md describes when the next request for events is due.
  /// `events`: see SetQueries. `something_else`: a background batch was saved.
  enum class Brought : std::uint8_t { news, no_news, something_else };
  void ReleaseEvents(std::size_t device, bool events, Brought brought, Instant now);

  /// Makes the group due at `at`, if that is earlier, because a part of it was not read. Only the
  /// first call before its next round counts, so no later call shortens a back-off.
  void Repeat(std::size_t device, config::Group group, Instant at) {
    devices_[device].of(group).Repeat(at);
  }
  /// Makes the group due in 8 s, because a query was not sent, or its reply may belong to another
  /// request. If the next rounds fail as well, in 16 s, 32 s … at most `most`. One call per round
  /// counts.
  void RepeatSoon(std::size_t device, config::Group group, Instant now, Duration most);
  /// Makes all groups due, because their values may have changed: at once, but at most twice in
  /// kHastenAgain, because a client that writes all the time must not fill the line.
  void Hasten(std::size_t device, Instant now);
  /// No query of the device is picked before `until`; its rounds wait.
  void Hold(std::size_t device, Instant until) {
    devices_[device].hold_until = std::max(devices_[device].hold_until, until);
  }
  /// Ends the hold, because a person wants the device to be polled now.
  void Release(std::size_t device) { devices_[device].hold_until = {}; }
  Instant held_until(std::size_t device) const { return devices_[device].hold_until; }
  bool suspended(std::size_t device) const { return devices_[device].suspended; }

  void OnUsed(std::size_t device, Duration time) { devices_[device].used += time; }
  /// The last exchange of the device failed, so other devices may go first. Suspend clears this.
  void SetFailing(std::size_t device, bool failing) { devices_[device].failing = failing; }
  bool failing(std::size_t device) const { return devices_[device].failing; }
  bool AnotherFails(std::size_t device) const;

  /// A write to the device has failed: a round of its polls goes before the next write. Else a
  /// client that writes without a pause would block the polls of the device.
  void GoFirst(std::size_t device);
  /// Returns whether its polls go before the next write, and one is due.
  bool GoesFirst(std::size_t device, Instant now) const {
    return devices_[device].go_first > 0 && HasCome(DueAt(devices_[device]), now);
  }

  /// Returns the query to send now, if one is due. `healthy_first`: a query of a failing device
  /// only if no other query is due.
  std::optional<Pick> Next(Instant now, bool healthy_first = false);
  bool HealthyDue(Instant now) const;
  /// Returns when Next will have a query; empty: no device is active. The time may be in the past.
  std::optional<Instant> NextDue() const;
  /// Returns the number of skipped periods of the device, including whole periods since it was due.
  std::uint32_t Missed(std::size_t device, Instant now) const;

 private:
  static constexpr Duration kHastenAgain = 10s;
  // Devices with similar line use take turns, because a device that is asked again at once may
  // still be sending.
  static constexpr Duration kAlike = 200ms;
  static constexpr std::size_t kLeastAtOnce = 4;  // number of requests for events
  // Indices of rounds: groups have their number, events follow.
  static constexpr auto kDaily = static_cast<std::size_t>(config::Group::daily);
  static constexpr auto kEvents = static_cast<std::size_t>(config::Group::again) + 1;

  struct Device {
    Round& of(config::Group group) { return rounds[static_cast<std::size_t>(group)]; }
    std::vector<Round> rounds = std::vector<Round>(kEvents + 1);
    std::vector<Round> before;  // rounds before the latest SetQueries
    Instant hold_until{};
    bool suspended = true;
    bool failing = false;
    // Between HoldEvents and ReleaseEvents; the round of events has no query meanwhile.
    bool events_held = false;
    Duration used{};
    Instant hasten_from{};     // earliest time at which the next Hasten takes effect
    std::size_t go_first = 0;  // number of polls before the next write
    std::size_t at_once = 0;   // how often the device may still be asked for events at once
    Instant at_once_until{};   // after this time at_once starts again
    std::uint32_t missed = 0;
  };

  /// Returns when the device may be asked; empty: not before another event.
  static std::optional<Instant> DueAt(const Device& device);

  std::vector<Device> devices_;
  std::uint64_t turn_ = 1;
  // The least line use of the devices that were due last; the other devices count as having used as
  // much.
  Duration used_{};
};

// `Background` chooses reads of low priority, such as load profiles. Proofs
// (gateway/bus/replies/whose_reply.h) may go with these reads, before a proof is needed and would
// delay a poll.
class Background {
 public:
  /// After this time a read goes out even if it does not fit.
  static constexpr Duration kLongest = std::chrono::minutes(1);
  static constexpr Duration kPause = 1s;  ///< wait after a read that could not be sent
  /// Number of exchanges after which the longest one decides how much time a read needs.
  static constexpr int kFew = 8;
  enum class Which : std::uint8_t { that_fits, that_starves };

  /// `schedule` must stay valid for the lifetime of this object.
  explicit Background(const Schedule& schedule) : schedule_(schedule) {}

  /// A background read of the device is wanted from `due` on; empty: none is wanted. `room`: how
  /// long an exchange may take, until the duration of the latest exchanges is known.
  void Set(std::size_t device, std::optional<Instant> due, Duration room) {
    At(device).due = due;
    At(device).room = room;
  }
  /// From `may` on a proof may go with its exchange, from `must` on a proof is required.
  void SetProof(std::size_t device, Instant may, Instant must) {
    At(device).may_prove = may;
    At(device).must_prove = must;
  }
  /// The latest data of the device are not on the disk yet: it gets no turn before Release.
  void AwaitDisk(std::size_t device) { At(device).awaits_disk = true; }
  void Release(std::size_t device) { At(device).awaits_disk = false; }

  std::optional<std::size_t> Next(Which which, Instant now) const;
  /// Returns when Next may have a device even if nothing else happens. The time may be in the past.
  std::optional<Instant> NextAt(Instant now) const;
  void OnTaken(std::size_t device, Instant now) {
    items_[device].taken = now;
    items_[device].again = {};
  }
  /// The exchange took `took`, including its proof; zero: it was not answered. Long exchanges are
  /// remembered for a while, because the next exchange may be as long.
  void NoteEnd(std::size_t device, Duration took, bool proved = false);
  /// No request was sent: the device gets no further turn at this moment.
  void OnUnsent(std::size_t device) { items_[device].again = items_[device].taken + kPause; }
  /// Returns whether another exchange of the device would end before the next poll is due.
  bool HasRoom(std::size_t device, Instant now) const {
    return device < items_.size() && Fits(items_[device], false, now);
  }
  /// Returns whether a proof may go with the exchange, and the two would end before the next poll
  /// is due.
  bool MayProve(std::size_t device, Instant now) const {
    return now >= items_[device].may_prove && Fits(items_[device], true, now);
  }

 private:
  struct Item {
    Duration Room(bool with_proof) const;
    Instant Starves() const { return std::max(*due, taken) + kLongest; }

    std::optional<Instant> due;
    Instant taken{};  // when the device had its last turn
    Instant again{};  // no turn before this time, because a request could not be sent
    Duration room{};
    int known = 0;       // number of exchanges without a proof
    Duration longest{};  // the longest exchange without a proof
    Duration longest_with_proof{};
    Instant may_prove = Instant::max();
    Instant must_prove = Instant::max();
    bool awaits_disk = false;
    bool lost = false;  // the last exchange was not answered, so the next may be silent as well
  };

  Item& At(std::size_t device) {
    if (items_.size() <= device) items_.resize(device + 1);
    return items_[device];
  }
  std::optional<Instant> MayBegin(std::size_t device) const;
  bool Fits(const Item& item, bool with_proof, Instant at) const {
    const auto poll = schedule_.NextDue();
    return !poll || *poll - at >= item.Room(with_proof);
  }

  const Schedule& schedule_;
  std::vector<Item> items_;
};

// `Turns` is the order of jobs on a line. Each kind of job has a limit, so that no kind starves.
class Turns {
 public:
  enum class Choice : std::uint8_t {
    urgent,  ///< short routed writes, writes to points, and the reads that follow them
    parked,  ///< a job that waits for its device: see ParkedJobs
    probe,   ///< has a budget of its own (probes.h), so it may go before the polls
    poll,    ///< the schedule's next query
    routed_high,
    routed_normal,
    routed_low,
  };

  struct Waiting {
    bool short_write = false;      ///< a short write of a route waits
    bool routed = false;           ///< any request of a route waits
    std::size_t high_clients = 0;  ///< number of clients with waiting requests of high priority
  };

  static constexpr int kUrgentInRow = 4;  ///< after these other jobs have a turn
  /// Short writes of routes may be many and belong together: a start and its set points.
  static constexpr int kRoutedWritesInRow = 16;
  /// Devices that fail have at most half of the time. Line time beyond that is a debt to the other
  /// devices, up to this limit.
  static constexpr Duration kMostDebt = std::chrono::minutes(1);

  /// Returns whether an urgent job may go before all other jobs.
  bool UrgentAllowed(bool short_write) const {
    return urgent_in_row_ < (short_write ? kRoutedWritesInRow : kUrgentInRow);
  }
  /// Returns the order of choices. The caller takes the first choice that has a job; a choice may
  /// be in the list twice.
  std::vector<Choice> Order(const Waiting& waiting) const;
  /// Call with the first choice that had a job.
  void OnTaken(Choice choice, const Waiting& waiting);
  /// Call if no choice had a job.
  void OnNothing() {
    urgent_in_row_ = 0;
    high_in_row_ = 0;
  }
  void OnSent(bool urgent) {
    if (!urgent) urgent_in_row_ = 0;
  }

  /// Time has passed. `failing`: the line was busy with a device whose last exchange failed.
  void OnTime(Duration passed, bool failing) {
    debt_ = std::clamp(debt_ + (failing ? passed : -passed), Duration::zero(), kMostDebt);
  }
  /// Adds line time without an answer of a device that was not known to fail before.
  void Charge(Duration lost) { debt_ += lost; }
  /// Returns whether devices that answer go first, because failing devices have had more than their
  /// share.
  bool HealthyFirst() const { return debt_ > Duration::zero(); }

 private:
  int urgent_in_row_ = 0;        // urgent jobs sent since the last job of another kind
  std::size_t high_in_row_ = 0;  // routed requests of high priority
  bool poll_next_ = false;       // polls and routed requests of normal priority take turns
  // Line time that failing devices took, and that other devices have not got back.
  Duration debt_{};
};

}  // namespace baudgate::bus
