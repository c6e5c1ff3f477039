// Which device is due (Round, Schedule), how long the line may still be used by reads that can wait
// (Background), and whose turn it is (Turns). README.md has the rules and a diagram of the shares.
// No input or output and no clock: the time is an argument. gateway/bus/jobs/chooser.cpp asks
// whenever the line is idle.
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
  Duration period{};             ///< zero: once
  std::optional<Instant> due{};  ///< start of the next round; empty: none
  std::size_t cursor = 0;        ///< next query; queries.size(): no round in progress
  std::uint64_t turn = 0;        ///< when it was last served, counted in picks
  bool due_early = false;        ///< due earlier than by its period
  bool repeats_soon = false;     ///< RepeatSoon was called since it began
  Duration soon = kSoonest;      ///< the wait of the next RepeatSoon

  bool active() const { return cursor < queries.size(); }
  void Stop() { cursor = queries.size(); }
  void Repeat(Instant at) {
    if (due_early || (due && *due <= at)) return;
    due = at;
    due_early = true;
  }
  /// Periods that have passed whole since it was due.
  std::uint32_t Passed(Instant now) const {
    if (active() || queries.empty() || !HasCome(due, now) || period == 0s) return 0;
    return static_cast<std::uint32_t>((now - *due) / period);
  }
  /// Begins if it is due; returns the periods that are skipped by that.
  std::uint32_t StartIfDue(Instant now) {
    if (active() || queries.empty() || !HasCome(due, now)) return 0;
    const std::uint32_t passed = Passed(now);
    cursor = 0;
    due_early = false;
    if (!std::exchange(repeats_soon, false)) soon = kSoonest;
    due = period == 0s ? std::nullopt : std::optional(*due + (std::int64_t{passed} + 1) * period);
    return passed;
  }
  /// Its queries were those of `before`. Example: two of four were asked, and one of these two is
  /// gone: one of three was asked, two are left. If there are more, it is not known which are new.
  void GoOnAfter(const Round& before) {
    const std::size_t left = before.queries.size() - before.cursor;
    cursor = queries.size() - std::min(left, queries.size());
    if (queries.size() > before.queries.size()) cursor = 0;
  }
};

/// In place of the number of a query: the events of the device.
inline constexpr std::size_t kEventsQuery = std::numeric_limits<std::size_t>::max();

// Which query of which device is next. A group that is due starts a round over its queries. The
// rounds of the device that has used the line least go on, in turn.
class Schedule {
 public:
  struct Pick {
    std::size_t device = 0;
    std::size_t query = 0;  ///< or kEventsQuery
    config::Group group = config::Group::fast;
    bool last_of_round = false;
  };

  /// A device without queries until SetQueries. Devices are numbered from 0.
  /// `intervals`: of the groups from config::Group::own on.
  std::size_t AddDevice(Duration fast_period, Duration slow_period,
                        Duration daily_period = std::chrono::hours(24),
                        const std::vector<Duration>& intervals = {});

  /// The groups of its queries, in the order of asking. Its rounds end; unless it is suspended, a
  /// restart or GoOn follows. `events`: it is asked for events as often as for the fast group.
  void SetQueries(std::size_t device, const std::vector<config::Group>& groups,
                  bool events = false);
  /// After SetQueries: rounds under way go on with what has become of their next query, others
  /// keep their time. Else each of a hundred refusals would start them again.
  void GoOn(std::size_t device, Instant now);
  /// All its groups are due at once, or when its hold ends: the port opened, or it came back.
  void Restart(std::size_t device, Instant now);
  /// The same after SetQueries, but a daily round that is under way goes on.
  void RestartAsPlanned(std::size_t device, Instant now);
  /// Nothing of the device is due until Restart: it is offline or disabled.
  void Suspend(std::size_t device);

  /// It is not asked for events until ReleaseEvents: the last ones are not on the disk yet.
  void HoldEvents(std::size_t device);
  /// They are on the disk; see the README for when the next request for events is due. `events`: as
  /// SetQueries. `something_else`: a background batch was kept.
  enum class Brought : std::uint8_t { news, no_news, something_else };
  void ReleaseEvents(std::size_t device, bool events, Brought brought, Instant now);

  /// The group is due at `at`, if that is earlier, because some of it could not be read. Only the
  /// first call before its next round counts, so nothing shortens a back-off.
  void Repeat(std::size_t device, config::Group group, Instant at) {
    devices_[device].of(group).Repeat(at);
  }
  /// The group is due again in 8 s, because a query was not sent, or its reply may belong to
  /// another request; if the next rounds fail too, after 16 s, 32 s … at most `most`. Once a round.
  void RepeatSoon(std::size_t device, config::Group group, Instant now, Duration most);
  /// All its groups are due, because what they read may have changed: at once, but at most twice in
  /// kHastenAgain, because a client that writes all the time must not fill the line.
  void Hasten(std::size_t device, Instant now);
  /// Nothing of the device is picked before `until`; its rounds wait.
  void Hold(std::size_t device, Instant until) {
    devices_[device].hold_until = std::max(devices_[device].hold_until, until);
  }
  /// A person wants it to be polled now.
  void Release(std::size_t device) { devices_[device].hold_until = {}; }
  Instant held_until(std::size_t device) const { return devices_[device].hold_until; }
  bool suspended(std::size_t device) const { return devices_[device].suspended; }

  /// A poll of it has taken the line for `time`.
  void OnUsed(std::size_t device, Duration time) { devices_[device].used += time; }
  /// Its last exchange failed: others may go first. Suspend forgets it.
  void SetFailing(std::size_t device, bool failing) { devices_[device].failing = failing; }
  bool failing(std::size_t device) const { return devices_[device].failing; }
  bool AnotherFails(std::size_t device) const;

  /// A write to it has failed: a round of its polls goes before the next write. Else a client that
  /// writes without a pause would have the device for itself.
  void GoFirst(std::size_t device);
  /// Its polls go before the next write, and one is due.
  bool GoesFirst(std::size_t device, Instant now) const {
    return devices_[device].go_first > 0 && HasCome(DueAt(devices_[device]), now);
  }

  /// The query to send now, if one is due. `healthy_first`: a query of a failing device only if no
  /// other is due.
  std::optional<Pick> Next(Instant now, bool healthy_first = false);
  /// Whether a query of a device that does not fail is due.
  bool HealthyDue(Instant now) const;
  /// When Next will have something; empty: no device is active. May lie in the past.
  std::optional<Instant> NextDue() const;
  /// Periods of the device that were skipped, including those that passed whole since it was due.
  std::uint32_t Missed(std::size_t device, Instant now) const;

 private:
  static constexpr Duration kHastenAgain = 10s;
  // Devices with similar line use take turns: one asked again at once may still be sending.
  static constexpr Duration kAlike = 200ms;
  static constexpr std::size_t kLeastAtOnce = 4;  // requests for events
  // Places of rounds: groups have their number, events follow.
  static constexpr auto kDaily = static_cast<std::size_t>(config::Group::daily);
  static constexpr auto kEvents = static_cast<std::size_t>(config::Group::again) + 1;

  struct Device {
    Round& of(config::Group group) { return rounds[static_cast<std::size_t>(group)]; }
    std::vector<Round> rounds = std::vector<Round>(kEvents + 1);
    std::vector<Round> before;  // as they were before the latest SetQueries
    Instant hold_until{};
    bool suspended = true;
    bool failing = false;
    bool events_held = false;  // HoldEvents; the round of events has no query meanwhile
    Duration used{};           // line time
    Instant hasten_from{};     // not hastened earlier than this
    std::size_t go_first = 0;  // polls before the next write
    std::size_t at_once = 0;   // how often it may still be asked for events at once
    Instant at_once_until{};   // from then on as often as at first again
    std::uint32_t missed = 0;
  };

  /// When it may be asked; empty: not before something else happens.
  static std::optional<Instant> DueAt(const Device& device);

  std::vector<Device> devices_;
  std::uint64_t turn_ = 1;
  Duration used_{};  // the least of the devices that were due last; the others count as having it
};

// Reads of low priority, such as load profiles, and the proofs of whose replies come that may go
// with them (gateway/bus/replies/whose_reply.h) before a proof is needed and would delay a poll.
class Background {
 public:
  static constexpr Duration kLongest = std::chrono::minutes(1);  ///< then it needs no room
  static constexpr Duration kPause = 1s;  ///< after a read that could not be sent
  static constexpr int kFew = 8;  ///< exchanges, from which on the longest says what room it needs
  enum class Which : std::uint8_t { that_fits, that_starves };

  /// `schedule` outlives it.
  explicit Background(const Schedule& schedule) : schedule_(schedule) {}

  /// Wanted from `due` on; empty: not at all. `room`: how long an exchange may take, until it is
  /// known how long the last ones took.
  void Set(std::size_t device, std::optional<Instant> due, Duration room) {
    At(device).due = due;
    At(device).room = room;
  }
  /// From `may` on a proof may go with its exchange, from `must` on it must.
  void SetProof(std::size_t device, Instant may, Instant must) {
    At(device).may_prove = may;
    At(device).must_prove = must;
  }
  /// What it brought last is not on the disk yet: it has no turn before Release.
  void AwaitDisk(std::size_t device) { At(device).awaits_disk = true; }
  void Release(std::size_t device) { At(device).awaits_disk = false; }

  std::optional<std::size_t> Next(Which which, Instant now) const;
  /// When Next may have something even if nothing else happens. May lie in the past.
  std::optional<Instant> NextAt(Instant now) const;
  void OnTaken(std::size_t device, Instant now) {
    items_[device].taken = now;
    items_[device].again = {};
  }
  /// The exchange took `took`, its proof included; zero: it was not answered. Long ones are
  /// remembered for a while, because the next may be as long.
  void NoteEnd(std::size_t device, Duration took, bool proved = false);
  /// Nothing was sent for it: it has no other turn at the same moment.
  void OnUnsent(std::size_t device) { items_[device].again = items_[device].taken + kPause; }
  /// Whether another exchange of the device would end before the next poll is due.
  bool HasRoom(std::size_t device, Instant now) const {
    return device < items_.size() && Fits(items_[device], false, now);
  }
  /// The same with a proof, if one may go with it.
  bool MayProve(std::size_t device, Instant now) const {
    return now >= items_[device].may_prove && Fits(items_[device], true, now);
  }

 private:
  struct Item {
    /// How long its next exchange may take.
    Duration Room(bool with_proof) const;
    Instant Starves() const { return std::max(*due, taken) + kLongest; }

    std::optional<Instant> due;
    Instant taken{};  // last
    Instant again{};  // not before: it could not be sent
    Duration room{};
    int known = 0;       // exchanges without a proof
    Duration longest{};  // of these
    Duration longest_with_proof{};
    Instant may_prove = Instant::max();
    Instant must_prove = Instant::max();
    bool awaits_disk = false;
    bool lost = false;  // the last one: the next may be silent as well
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

// The order of jobs on a line; each kind of job has a limit, so that none starves.
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
    bool short_write = false;      ///< of a route
    bool routed = false;           ///< anything of a route
    std::size_t high_clients = 0;  ///< that wait with requests of high priority
  };

  static constexpr int kUrgentInRow = 4;  ///< after these anything else has its turn
  /// Short writes of routes may be many and belong together: a start, its set points.
  static constexpr int kRoutedWritesInRow = 16;
  /// Devices that fail have at most half of the time; what they took beyond it is owed, up to this.
  static constexpr Duration kMostDebt = std::chrono::minutes(1);

  /// Whether an urgent job may go before everything else.
  bool UrgentAllowed(bool short_write) const {
    return urgent_in_row_ < (short_write ? kRoutedWritesInRow : kUrgentInRow);
  }
  /// The caller takes the first choice that has something to send; one may be in it twice.
  std::vector<Choice> Order(const Waiting& waiting) const;
  /// The first choice that had something.
  void OnTaken(Choice choice, const Waiting& waiting);
  /// No choice had anything.
  void OnNothing() {
    urgent_in_row_ = 0;
    high_in_row_ = 0;
  }
  /// A request went out.
  void OnSent(bool urgent) {
    if (!urgent) urgent_in_row_ = 0;
  }

  /// Time has passed; `failing`: the line was busy with a device whose last exchange failed.
  void OnTime(Duration passed, bool failing) {
    debt_ = std::clamp(debt_ + (failing ? passed : -passed), Duration::zero(), kMostDebt);
  }
  /// Line time that a device took in vain before it was known to fail.
  void Charge(Duration lost) { debt_ += lost; }
  /// Devices that answer go first: those that fail have had more than their share.
  bool HealthyFirst() const { return debt_ > Duration::zero(); }

 private:
  int urgent_in_row_ = 0;        // urgent jobs sent since the last job of another kind
  std::size_t high_in_row_ = 0;  // routed requests of high priority
  bool poll_next_ = false;       // polls and routed requests of normal priority take turns
  Duration debt_{};  // line time that failing devices took and the others have not yet got back
};

}  // namespace baudgate::bus
