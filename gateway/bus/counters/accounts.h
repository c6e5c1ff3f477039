// `Accounts` groups all data that the status shows of a line: `LineAccount` (line_account.h), the
// accounts of its devices (`DeviceAccounts`), their states (`DeviceStates`,
// gateway/bus/devices/device_states.h), and the duration of their fast rounds (`FastRounds`).
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <string>

#include "gateway/base/outcome.h"
#include "gateway/base/time.h"
#include "gateway/bus/counters/line_account.h"
#include "gateway/bus/devices/device_states.h"
#include "gateway/bus/devices/poller_listener.h"
#include "gateway/bus/devices/roster.h"
#include "gateway/bus/exchange/line.h"
#include "gateway/bus/points/device_status.h"
#include "gateway/bus/points/point_store.h"
#include "gateway/bus/replies/ended_exchange.h"
#include "gateway/bus/schedule/schedule.h"

namespace baudgate::bus {

// `DeviceAccounts` counts, for each member of a line, how its exchanges, polls and writes ended,
// and how much line time they took. It writes the counts to the point store. Called by
// DeviceTracker and by jobs.
class DeviceAccounts final : public ExchangeObserver {
 public:
  /// All references must stay valid for the lifetime of this object.
  DeviceAccounts(const Roster& roster, const Schedule& schedule, PointStore& store,
                 PollerListener& listener)
      : roster_(roster), schedule_(schedule), store_(store), listener_(listener) {}

  /// Time has passed. The line was busy for `took` of it, with `member` (null: unknown). `drains`:
  /// the line kept silence after an exchange of that member.
  void OnTime(Now now, const Member* member, Duration took, bool drains);
  void OnOpened();

  void OnExchange(const EndedExchange& ended, Now now) override;
  /// The conversation could not make a request.
  void OnUnsupported(const Member& member, const std::string& reason);
  void OnRetry(const Member& member);
  /// A reading counts only if a second reading agrees.
  void OnRecheck(const Member& member);
  void OnUnconfirmed(const Member& member);
  /// `patience`: see EndedExchange.
  void OnLate(const Member& member, Duration lateness, Duration patience);
  void OnSecondReply(const Member& member);

  /// A task has ended, with all its repetitions.
  void OnTask(const Member& member, bool answered);
  /// A poll has ended. `missed`: at least one exchange of it failed, perhaps before a repetition.
  void OnPoll(const Device& device, std::size_t query, bool answered, bool missed);
  void OnPlan(const Device& device);
  /// A command has ended. `read_back`: the device shows the written value.
  void OnWrite(const Member& member, WriteEnd end, bool read_back);
  void OnOffline(const Member& member);

  void OnSpeaks(const Member& member);
  void OnUnasked(const Member& member, Outcome outcome, const std::string& reason);
  void OnLostEvents(const Member& member, std::size_t events);

 private:
  struct Entry {
    Duration busy{};           // line time that the member has taken
    Duration counted{};        // part of `busy` that the status contains already
    Duration drained{};        // line time of the silence after its last exchange
    Instant heard{};           // end of the last exchange, or when the port was opened
    bool out = false;          // the last task has failed
    std::uint32_t missed = 0;  // number of skipped poll periods
    Duration patience{};       // value in the status
    std::uint32_t behind = 0;  // value in the status
    bool told_second = false;  // the user was warned of a second, different reply
  };

  void Change(const Member& member, const std::function<void(DeviceStatus&)>& change);
  void CountMissed();
  void ShowPatience(const Member& member, Duration more);
  void ShowLag(const Member& member, bool lags);
  void Count(const Member& member, bool answered, DeviceStatus& status);

  const Roster& roster_;
  const Schedule& schedule_;
  PointStore& store_;
  PollerListener& listener_;
  ByMember<Entry> entries_;
  Now now_{};
};

// `FastRounds` measures how long one fast round of all polled devices of a line takes. The point
// store derives the age limits of fast values from it. Called by
// gateway/bus/jobs/device_tracker.cpp and gateway/bus/jobs/job.cpp.
class FastRounds {
 public:
  /// All references must stay valid for the lifetime of this object.
  FastRounds(const Roster& roster, PointStore& store) : roster_(roster), store_(store) {}

  struct Poll {
    Duration wire{};
    bool answered = false;
    bool last_of_round = false;
  };
  /// A poll of the fast group has ended. Rounds with failures, and waiting time, do not count: an
  /// outage must not make old values look younger.
  void OnPoll(const Member& member, const Poll& poll, Instant now);
  void OnPlan(const Device& device);
  /// Call when a device of the line has come or gone.
  void Measure(Instant now) const;

 private:
  struct Entry {
    bool clean = true;  // no poll has failed in the round under way
    Duration wire{};    // line time of the round so far
    Duration last{};    // line time of the last whole round
  };

  const Roster& roster_;
  PointStore& store_;
  ByMember<Entry> entries_;
};

struct Accounts {
  /// `line_index`: index in the point store. All references must stay valid for the lifetime of
  /// this object.
  Accounts(const Roster& roster, const Schedule& schedule, PointStore& store,
           std::uint32_t line_index, PollerListener& listener)
      : line(store, line_index, listener),
        devices(roster, schedule, store, listener),
        states(roster, store, listener),
        rounds(roster, store) {}

  /// Time has passed. `busy`: the line was busy, with `member` (null: unknown). `drains`: the line
  /// kept silence after an exchange of that member.
  void OnTime(Now now, bool busy, const Member* member, bool drains = false) {
    const Duration took = line.OnTime(now, busy, drains);
    devices.OnTime(now, member, took, drains);
    states.OnTime(now);
  }
  void OnOpened() {
    line.OnOpened();
    devices.OnOpened();
    states.OnOpened();
  }
  void OnClosed(Override why) {
    line.OnClosed();
    states.OnClosed(why);
  }
  void Attach(Tap& tap) {
    line.Attach(tap);
    states.Attach(tap);
  }

  LineAccount line;
  DeviceAccounts devices;
  DeviceStates states;
  FastRounds rounds;
};

}  // namespace baudgate::bus
