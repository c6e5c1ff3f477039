// The schedule of a line. `Schedule` decides which query of which device is polled next,
// `Background` chooses reads of low priority, and `Turns` decides which kind of job is next.
// gateway/bus/schedule/README.md has the rules and a diagram. These classes have no I/O and no
// clock: the time is an argument. Chooser (gateway/bus/jobs/chooser.h) asks them whenever the line
// is idle.
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

// `Round` contains the queries of one group of one device. When the group is due, a round asks each
// query once. gateway/bus/schedule/README.md has an example.
struct Round {
  static constexpr Duration kSoonest = config::kAgainPeriod;
  std::vector<std::size_t> queries{};
  Duration period{};  ///< time from the start of a round to the next; zero: only one round
  std::optional<Instant> due{};  ///< when the next round starts; empty: there is no next round
  std::size_t cursor = 0;        ///< index of the next query; queries.size(): no round in progress
  std::uint64_t turn = 0;        ///< Schedule::turn_ when a query of this round was last picked
  bool due_early = false;        ///< `due` is earlier than the period requires
  bool repeats_soon = false;     ///< Schedule::RepeatSoon was called since the last round began
  Duration soon = kSoonest;      ///< wait before the next round, if RepeatSoon is called

  bool active() const { return cursor < queries.size(); }
  void Stop() { cursor = queries.size(); }
  void Repeat(Instant at) {
    if (due_early || (due && *due <= at)) return;
    due = at;
    due_early = true;
  }
  /// Returns how many whole periods have passed since the round was due; 0 while the round is in
  /// progress.
  std::uint32_t Passed(Instant now) const {
    if (active() || queries.empty() || !HasCome(due, now) || period == 0s) return 0;
    return static_cast<std::uint32_t>((now - *due) / period);
  }
  /// Starts a round if it is due. Returns the number of periods that were skipped.
  std::uint32_t StartIfDue(Instant now) {
    if (active() || queries.empty() || !HasCome(due, now)) return 0;
    const std::uint32_t passed = Passed(now);
    cursor = 0;
    due_early = false;
    if (!std::exchange(repeats_soon, false)) soon = kSoonest;
    due = period == 0s ? std::nullopt : std::optional(*due + (std::int64_t{passed} + 1) * period);
    return passed;
  }
  /// Continues the round `before`, which was in progress when its queries changed: as many queries
  /// are left as before. Example: two of four queries were asked, and one of these two is removed,
  /// so one of three counts as asked. If there are more queries than before, it is not known which
  /// are new, so the round starts again.
  void GoOnAfter(const Round& before) {
    const std::size_t left = before.queries.size() - before.cursor;
    cursor = queries.size() - std::min(left, queries.size());
    if (queries.size() > before.queries.size()) cursor = 0;
  }
};

/// In place of a query number: the device is asked for its events.
inline constexpr std::size_t kEventsQuery = std::numeric_limits<std::size_t>::max();

// `Schedule` decides which query of which device is polled next. A group that is due starts a
// round, which asks each query of the group once. The device that has used the least line time is
// next.
class Schedule {
 public:
  struct Pick {
    std::size_t device = 0;
    std::size_t query = 0;  ///< number of the query, or kEventsQuery
    config::Group group = config::Group::fast;
    bool last_of_round = false;
  };

  /// Adds a device, without queries so far (see SetQueries). Devices are numbered from 0.
  /// `intervals`: periods of the groups that the user defines (config::OwnGroup).
  std::size_t AddDevice(Duration fast_period, Duration slow_period,
                        Duration daily_period = std::chrono::hours(24),
                        const std::vector<Duration>& intervals = {});

  /// Sets the group of each query of a device. Rounds in progress end. Call Restart,
  /// RestartAsPlanned or GoOn afterwards, unless the device is suspended. `events`: the device is
  /// asked for events as often as for the fast group.
  void SetQueries(std::size_t device, const std::vector<config::Group>& groups,
                  bool events = false);
  /// Call after SetQueries. A round in progress goes on with the queries in the place of its next
  /// query, and other rounds keep their times. (Restart would start all rounds again, after each of
  /// a hundred refused queries.)
  void GoOn(std::size_t device, Instant now);
  /// Makes all groups of the device due now, or when its Hold ends. Call when the port has opened,
  /// or the device is back.
  void Restart(std::size_t device, Instant now);
  /// Call after SetQueries. Does the same as Restart, but a daily round in progress continues.
  void RestartAsPlanned(std::size_t device, Instant now);
  /// Stops all polls of the device until Restart, because it is offline or disabled.
  void Suspend(std::size_t device);

  /// Stops requests for events until ReleaseEvents, because the last events are not saved on disk
  /// yet.
  void HoldEvents(std::size_t device);
  /// Call when the latest events are saved on disk, so that the device is asked for events again.
  /// gateway/bus/schedule/README.md describes when ("Events"). `events`: see SetQueries. `brought`:
  /// what was saved; something_else: the data of a background read.
  enum class Brought : std::uint8_t { news, no_news, something_else };
  void ReleaseEvents(std::size_t device, bool events, Brought brought, Instant now);

  /// Makes the group due at `at`, unless it is due before, because a part of it was not read.
  /// Further calls before the next round do nothing, so they do not shorten a wait of RepeatSoon.
  void Repeat(std::size_t device, config::Group group, Instant at) {
    devices_[device].of(group).Repeat(at);
  }
  /// Makes the group due in 8 s, because a query was not sent, or its reply may belong to another
  /// request. After further failures the wait is 16 s, 32 s …, at most `most`. Further calls in the
  /// same round do nothing.
  void RepeatSoon(std::size_t device, config::Group group, Instant now, Duration most);
  /// Makes all groups of the device due, because their values may have changed: now, or
  /// kHastenAgain after the previous call that took effect at once. So a client that writes all the
  /// time does not fill the line.
  void Hasten(std::size_t device, Instant now);
  /// Sends no query of the device before `until`; its rounds wait.
  void Hold(std::size_t device, Instant until) {
    devices_[device].hold_until = std::max(devices_[device].hold_until, until);
  }
  /// Ends Hold, because a user wants the device to be polled now.
  void Release(std::size_t device) { devices_[device].hold_until = {}; }
  Instant held_until(std::size_t device) const { return devices_[device].hold_until; }
  bool suspended(std::size_t device) const { return devices_[device].suspended; }

  void OnUsed(std::size_t device, Duration time) { devices_[device].used += time; }
  /// Stores whether the last exchange of the device failed, because other devices then go first.
  /// Suspend sets it to false.
  void SetFailing(std::size_t device, bool failing) { devices_[device].failing = failing; }
  bool failing(std::size_t device) const { return devices_[device].failing; }
  bool AnotherFails(std::size_t device) const;

  /// Call when a write to the device has failed: one poll of each query goes before the next write.
  /// Otherwise a client that writes all the time would block the polls of the device.
  void GoFirst(std::size_t device);
  /// True if polls of the device have to go before its next write, and a poll is due.
  bool GoesFirst(std::size_t device, Instant now) const {
    return devices_[device].go_first > 0 && HasCome(DueAt(devices_[device]), now);
  }

  /// Returns the query to send now; empty: no query is due. `healthy_first`: a query of a failing
  /// device is returned only if no other query is due.
  std::optional<Pick> Next(Instant now, bool healthy_first = false);
  bool HealthyDue(Instant now) const;
  /// Returns when Next will have a query; empty: no device is polled. The time can be in the past.
  std::optional<Instant> NextDue() const;
  /// Returns how many periods of the device were skipped. For a round that is due but has not
  /// begun, the periods since then are included.
  std::uint32_t Missed(std::size_t device, Instant now) const;

 private:
  static constexpr Duration kHastenAgain = 10s;
  // Devices whose line use differs less than this take turns, because a device that is asked twice
  // in a row may still be sending.
  static constexpr Duration kAlike = 200ms;
  static constexpr std::size_t kLeastAtOnce = 4;  // smallest initial value of Device::at_once
  // Indices of rounds: each group has its number, then comes the round of events.
  static constexpr auto kDaily = static_cast<std::size_t>(config::Group::daily);
  static constexpr auto kEvents = static_cast<std::size_t>(config::Group::again) + 1;

  struct Device {
    Round& of(config::Group group) { return rounds[static_cast<std::size_t>(group)]; }
    std::vector<Round> rounds = std::vector<Round>(kEvents + 1);
    std::vector<Round> before;  // the rounds before the latest SetQueries
    Instant hold_until{};
    bool suspended = true;
    bool failing = false;
    // True between HoldEvents and ReleaseEvents: the round of events then has no query.
    bool events_held = false;
    Duration used{};
    Instant hasten_from{};     // Hasten does nothing before this time
    std::size_t go_first = 0;  // number of polls that go before the next write
    std::size_t at_once = 0;   // requests for events that may still follow at once after new events
    Instant at_once_until{};   // when `at_once` gets its initial value again
    std::uint32_t missed = 0;
  };

  /// Returns when a query of the device is due; empty: none becomes due by time alone.
  static std::optional<Instant> DueAt(const Device& device);

  std::vector<Device> devices_;
  std::uint64_t turn_ = 1;
  // The least line use among devices that were due. A device with less line use counts as this
  // much, so that it does not get all the line time after a pause.
  Duration used_{};
};

// `Background` chooses reads of low priority, such as load profiles. A proof, a probe whose reply
// differs from all other replies (gateway/bus/replies/whose_reply.h), can be made together with
// such a read, before the proof is necessary and would delay a poll.
class Background {
 public:
  /// A read that is due is sent after this time even if there is not enough time before the next
  /// poll.
  static constexpr Duration kLongest = std::chrono::minutes(1);
  static constexpr Duration kPause = 1s;  ///< wait after a read that could not be sent
  /// After this many answered reads, the longest of them shows how much time a read needs. Until
  /// then, `room` of Set counts.
  static constexpr int kFew = 8;
  enum class Which : std::uint8_t { that_fits, that_starves };

  /// `schedule` must stay valid for the lifetime of this object.
  explicit Background(const Schedule& schedule) : schedule_(schedule) {}

  /// The next background read of the device is due at `due`; empty: there is no further background
  /// read. `room`: estimated duration of an exchange, until the duration of the latest exchanges is
  /// known.
  void Set(std::size_t device, std::optional<Instant> due, Duration room) {
    At(device).due = due;
    At(device).room = room;
  }
  /// From `may` on a proof can be made together with a read of the device; from `must` on a read
  /// needs a proof.
  void SetProof(std::size_t device, Instant may, Instant must) {
    At(device).may_prove = may;
    At(device).must_prove = must;
  }
  /// The latest data of the device are not saved on disk yet, so it has no read until Release.
  void AwaitDisk(std::size_t device) { At(device).awaits_disk = true; }
  void Release(std::size_t device) { At(device).awaits_disk = false; }

  std::optional<std::size_t> Next(Which which, Instant now) const;
  /// Returns when Next can return a device if nothing else happens until then.
  std::optional<Instant> NextAt(Instant now) const;
  void OnTaken(std::size_t device, Instant now) {
    items_[device].taken = now;
    items_[device].again = {};
  }
  /// A read of the device has ended. `took`: its duration with its proof; zero: it was not
  /// answered. Long durations are remembered for some time, because the next read may take as long.
  void NoteEnd(std::size_t device, Duration took, bool proved = false);
  /// Call when the read could not be sent. The device has no read for kPause.
  void OnUnsent(std::size_t device) { items_[device].again = items_[device].taken + kPause; }
  /// True if a read of the device would end before the next poll is due.
  bool HasRoom(std::size_t device, Instant now) const {
    return device < items_.size() && Fits(items_[device], false, now);
  }
  /// True if a background read of the device, and the probe before it that proves the order of
  /// replies, would now end before the next poll is due.
  bool MayProve(std::size_t device, Instant now) const {
    return now >= items_[device].may_prove && Fits(items_[device], true, now);
  }

 private:
  struct Item {
    Duration Room(bool with_proof) const;
    Instant Starves() const { return std::max(*due, taken) + kLongest; }

    std::optional<Instant> due;
    Instant taken{};  // when the last read of the device was taken
    Instant again{};  // no read before this time, because a request could not be sent
    Duration room{};
    int known = 0;       // number of answered reads without a proof
    Duration longest{};  // the longest read without a proof
    Duration longest_with_proof{};
    Instant may_prove = Instant::max();
    Instant must_prove = Instant::max();
    bool awaits_disk = false;
    bool lost = false;  // the last read was not answered, so `room` counts
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

// `Turns` decides in which order the kinds of jobs get the line. Urgent jobs and requests of high
// priority have a limit, so that polls do not wait without end.
class Turns {
 public:
  enum class Choice : std::uint8_t {
    urgent,  ///< short writes of clients, writes to points, and their read-backs
    parked,  ///< a job that has waited for its device: see ParkedJobs in gateway/bus/jobs/agenda.h
    probe,   ///< limited by ProbeBudget, so it can go before polls
    poll,    ///< the next query of the schedule
    routed_high,
    routed_normal,
    routed_low,
  };

  struct Waiting {
    bool short_write = false;      ///< a short write of a client waits (a start or stop)
    bool routed = false;           ///< any request of a client of a route waits
    std::size_t high_clients = 0;  ///< number of clients with waiting requests of high priority
  };

  /// After this many urgent jobs in a row, jobs of other kinds go first.
  static constexpr int kUrgentInRow = 4;
  /// The limit in place of kUrgentInRow while a short write of a client waits, because a start and
  /// its set points belong together.
  static constexpr int kRoutedWritesInRow = 16;
  /// Failing devices (their last exchange failed) get at most half of the line time. Their time
  /// beyond half is a debt to the other devices, limited to this value.
  static constexpr Duration kMostDebt = std::chrono::minutes(1);

  /// True if an urgent job goes before all other jobs.
  bool UrgentAllowed(bool short_write) const {
    return urgent_in_row_ < (short_write ? kRoutedWritesInRow : kUrgentInRow);
  }
  /// Returns the kinds of jobs in order. The caller takes a job of the first kind that has one. A
  /// kind can be in the list twice.
  std::vector<Choice> Order(const Waiting& waiting) const;
  void OnTaken(Choice choice, const Waiting& waiting);
  void OnNothing() {
    urgent_in_row_ = 0;
    high_in_row_ = 0;
  }
  void OnSent(bool urgent) {
    if (!urgent) urgent_in_row_ = 0;
  }

  /// Call with the time since the previous call. `failing`: the line was busy with a device whose
  /// last exchange failed.
  void OnTime(Duration passed, bool failing) {
    debt_ = std::clamp(debt_ + (failing ? passed : -passed), Duration::zero(), kMostDebt);
  }
  /// Adds the line time of a device's first failed exchange. OnTime did not count it as failing,
  /// because the previous exchange was good.
  void Charge(Duration lost) { debt_ += lost; }
  /// True if devices that answer go first, because failing devices have used more than half of the
  /// time.
  bool HealthyFirst() const { return debt_ > Duration::zero(); }

 private:
  int urgent_in_row_ = 0;
  std::size_t high_in_row_ = 0;
  bool poll_next_ = false;  // polls and routed_normal take turns; true: a poll is next
  Duration debt_{};
};

}  // namespace baudgate::bus
