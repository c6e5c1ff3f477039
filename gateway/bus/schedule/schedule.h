// Which device is asked for what, and when: periods on a fixed grid, fair and without starvation.
// Knows nothing of bytes, lines or clocks; gateway/bus/jobs/chooser.cpp asks it whenever the line
// is idle.
//
// A group of a device that is due starts a *round* over its queries. Among all rounds in progress,
// one of the device that has used the line least goes on by one query; among several, the one that
// has waited longest. So no device, however slow, and no group can starve another. A round that
// begins late keeps its period if the next one has not begun; periods that passed whole are missed:
// counted, skipped, never queued.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <limits>
#include <optional>
#include <vector>

#include "config/model/point.h"
#include "gateway/base/time.h"
#include "gateway/bus/schedule/round.h"

namespace baudgate {

/// In place of the number of a query: the events of the device.
inline constexpr std::size_t kEventsQuery = std::numeric_limits<std::size_t>::max();

/// A query of a device of the line, by their numbers.
struct QueryRef {
  std::size_t device = 0;
  std::size_t query = 0;
  bool operator==(const QueryRef&) const = default;
};

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

}  // namespace baudgate
