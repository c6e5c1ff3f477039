// Which device is asked for what, and when: periods on a fixed grid, fair and without starvation.
// Knows nothing of bytes, lines or clocks; gateway/bus/jobs/chooser.cpp asks it whenever the line
// is idle.
//
// A group of a device that is due starts a *round* over its queries. Among all rounds in progress,
// one of the device that has used the line least goes on by one query; among several, the one that
// has waited longest. So no device, however slow, and no group can starve another. A round that
// begins late keeps its period if the next one has not begun; periods that passed whole are missed:
// counted, skipped, never queued.
//
// Round keeps the queries of one group, and Background the reads of low priority.
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

// The queries of one group of one device, on the fixed grid of the group's period.
//
//   due at 10 s, period 5 s
//   begun at 11 s    the next round is due at 15 s
//   begun at 22 s    two periods have passed whole: missed 2, the next round is due at 25 s
//
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

/// In place of the number of a query: the events of the device.
inline constexpr std::size_t kEventsQuery = std::numeric_limits<std::size_t>::max();

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

  /// The groups of the device's queries, in the order of asking. Rounds in progress end, but
  /// that of group `once` starts again, and the daily one goes on where it was or starts again.
  /// `events`: it is asked for events as often as for the fast group.
  void SetQueries(std::size_t device, std::vector<config::Group> groups, bool events = false);
  /// It is not asked for events until ReleaseEvents: the last ones are not on the disk yet.
  void HoldEvents(std::size_t device);
  /// When its next request for events is due. After `news`: at once, because there may be more, but
  /// in a period no more often than the line has queries. After `no_news`: when it is its turn.
  /// After `something_else` (a background batch was kept): as without the hold. `events`: as
  /// SetQueries.
  enum class Brought : std::uint8_t { news, no_news, something_else };
  void ReleaseEvents(std::size_t device, bool events, Brought brought, Instant now);

  /// All groups of the device are due at once, or when its hold ends: the port opened, or the
  /// device came back.
  void Restart(std::size_t device, Instant now);
  /// The same after SetQueries, but a daily round that is under way goes on.
  void RestartAsPlanned(std::size_t device, Instant now);
  /// After SetQueries: rounds under way go on with what has become of their next query, others keep
  /// their time. Else each of a hundred refusals would start them again.
  void GoOn(std::size_t device, Instant now);
  /// Nothing of the device is due until Restart: it is offline or disabled.
  void Suspend(std::size_t device);
  /// The group is due again at `at`, because some of it could not be read.
  void Repeat(std::size_t device, config::Group group, Instant at);
  /// The group is due again in 8 s, because a query was not sent, or its reply may belong to
  /// another request. If the next round fails in the same way, after 16 s, 32 s … at most `most`.
  void RepeatSoon(std::size_t device, config::Group group, Instant now, Duration most);
  /// All groups of the device are due again: what they read may have changed. At once, but if that
  /// comes often, at most twice in kHastenAgain: a client that writes all the time must not fill
  /// the line.
  void Hasten(std::size_t device, Instant now);
  /// A poll of it has taken the line for `time`.
  void OnUsed(std::size_t device, Duration time) { devices_[device].used += time; }
  /// Its last exchange failed: others may go first. Suspend forgets it.
  void SetFailing(std::size_t device, bool failing) { devices_[device].failing = failing; }
  bool failing(std::size_t device) const { return devices_[device].failing; }
  /// A device that is offline or disabled does not count.
  bool AnotherFails(std::size_t device) const;
  /// Nothing of the device is picked before `until`; its rounds wait.
  void Hold(std::size_t device, Instant until);
  /// A person wants it to be polled now.
  void Release(std::size_t device) { devices_[device].hold_until = {}; }

  /// A write to it has failed: a round of its polls goes before the next write. Else a client that
  /// writes without a pause would have the device for itself.
  void GoFirst(std::size_t device);
  /// Its polls go before the next write, and one is due.
  bool GoesFirst(std::size_t device, Instant now) const;

  /// The query to send now, if one is due. `healthy_first`: a query of a failing device only if no
  /// other is due.
  std::optional<Pick> Next(Instant now, bool healthy_first = false);
  /// Whether a query of a device that does not fail is due.
  bool HealthyDue(Instant now) const;
  /// When Next will have something; empty: no device is active. May lie in the past.
  std::optional<Instant> NextDue() const;

  Instant held_until(std::size_t device) const { return devices_[device].hold_until; }
  bool suspended(std::size_t device) const { return devices_[device].suspended; }

  /// Periods of the device that were skipped, including those that passed whole since it was due.
  std::uint32_t Missed(std::size_t device, Instant now) const;

 private:
  struct Device {
    std::vector<Round> rounds;  // by NumberOf their groups, and kEvents
    Instant hold_until{};
    bool suspended = true;
    bool failing = false;
    Duration used{};        // line time; an idle device is credited with what others used meanwhile
    Instant hasten_from{};  // not hastened earlier than this
    std::size_t go_first = 0;  // polls before the next write
    int at_once = 0;           // how often it may still be asked for events at once
    Instant at_once_until{};   // from then on as often as at first again
    std::uint32_t missed = 0;
  };

  static constexpr Duration kHastenAgain = 10s;
  static constexpr std::size_t kEvents = config::kNamedGroups;  // own intervals follow
  static constexpr auto kDaily = static_cast<std::size_t>(config::Group::daily);

  static constexpr std::size_t NumberOf(config::Group group) {
    return static_cast<std::size_t>(group) + (group >= config::Group::own ? 1 : 0);
  }
  static constexpr config::Group GroupOf(std::size_t round) {
    return static_cast<config::Group>(round - (round > kEvents ? 1 : 0));
  }
  int QueriesOfARound() const;
  static std::optional<Instant> DueAt(const Device& device, const Round& round);
  static bool IsDue(const Device& device, Instant now);

  std::vector<Device> devices_;
  std::uint64_t turn_ = 0;
  Duration used_{};  // the least of the devices that were due last
};

// Low-priority reads, such as load profiles: sent when they fit before the next poll is due, so no
// poll is delayed. On a line that is never idle for long enough, one is sent once a minute anyway.
// Among several devices the one that has waited longest goes first.
//
//   polls due at 1.0 s and 2.0 s, room 400 ms      taken at 1.1 s; not at 1.7 s
//
// From time to time a proof has to show whose replies come (gateway/bus/replies/whose_reply.h),
// which would delay a poll. If there is room, the proof goes with a background exchange before it
// is needed.
class Background {
 public:
  static constexpr Duration kLongest = std::chrono::minutes(1);
  /// After a read that could not be sent.
  static constexpr Duration kPause = 1s;
  static constexpr int kFew = 8;
  enum class Which : std::uint8_t { that_fits, that_starves };

  /// `schedule` outlives it.
  explicit Background(const Schedule& schedule) : schedule_(schedule) {}

  /// Wanted from `due` on; empty: not at all. `room`: how long an exchange may take, until it is
  /// known how long the last one took.
  void Set(std::size_t device, std::optional<Instant> due, Duration room);
  /// From `may` on a proof may go with its exchange, from `must` on it must.
  void SetProof(std::size_t device, Instant may, Instant must);
  /// What it brought last is not on the disk yet: it has no turn before Release.
  void AwaitDisk(std::size_t device) { At(device).awaits_disk = true; }
  void Release(std::size_t device) { At(device).awaits_disk = false; }

  std::optional<std::size_t> Next(Which which, Instant now) const;
  void OnTaken(std::size_t device, Instant now);
  /// The exchange took `took`, its proof included; zero: it was not answered. Long ones are
  /// remembered for a while, because the next may be as long.
  void NoteEnd(std::size_t device, Duration took, bool proved = false);
  /// Nothing was sent for it: it has no other turn at the same moment.
  void OnUnsent(std::size_t device) { items_[device].again = items_[device].taken + kPause; }
  /// Whether another exchange of the device would end before the next poll is due.
  bool HasRoom(std::size_t device, Instant now) const;
  /// The same with a proof, if one may go with it.
  bool MayProve(std::size_t device, Instant now) const;
  /// When Next may have something even if nothing else happens. May lie in the past.
  std::optional<Instant> NextAt(Instant now) const;

 private:
  /// The longest of the exchanges of one kind.
  struct Longest {
    Duration took{};
    int known = 0;  // exchanges
    void Learn(Duration took);
  };
  struct Item {
    std::optional<Instant> due;
    Instant taken{};  // last
    Instant again{};  // not before: it could not be sent
    Duration room{};
    Longest plain;
    Longest proved;
    Instant may_prove = Instant::max();
    Instant must_prove = Instant::max();
    std::uint64_t turn = 0;
    bool awaits_disk = false;
    bool lost = false;  // the last one: the next may be silent as well
  };

  Item& At(std::size_t device);
  /// From when on it may be asked; empty: not before something else happens.
  std::optional<Instant> MayBegin(std::size_t device) const;
  Instant Starves(const Item& item) const;
  bool Fits(const Item& item, Instant at) const;
  bool IsIdleFor(Duration room, Instant at) const;
  static Duration RoomOf(const Item& item);
  static Duration RoomToProve(const Item& item);

  const Schedule& schedule_;
  std::vector<Item> items_;
  std::uint64_t turn_ = 0;
};

}  // namespace baudgate::bus
