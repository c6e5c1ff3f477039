// All that the status shows of a line: its own account, those of its devices, their states, and how
// long their fast rounds take. DeviceAccounts and FastRounds are parts; Accounts joins them with
// LineAccount (line_account.h) and DeviceStates (gateway/bus/devices/device_states.h).
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

// The accounts of the members of a line: how their exchanges, polls and writes have ended, and how
// much line time they took. Shown in the point store. Driven by DeviceTracker and by jobs.
class DeviceAccounts final : public ExchangeObserver {
 public:
  /// All references outlive it.
  DeviceAccounts(const Roster& roster, const Schedule& schedule, PointStore& store,
                 PollerListener& listener)
      : roster_(roster), schedule_(schedule), store_(store), listener_(listener) {}

  /// Time has passed. The line was busy for `took` of it, with `member` if that is known; `drains`:
  /// it kept silence after an exchange of that member.
  void OnTime(Now now, const Member* member, Duration took, bool drains);
  /// The port has opened.
  void OnOpened();

  void OnExchange(const EndedExchange& ended, Now now) override;
  /// The conversation refused to make a request.
  void OnUnsupported(const Member& member, const std::string& reason);
  void OnRetry(const Member& member);
  /// A reading counts only when a second one agrees.
  void OnRecheck(const Member& member);
  void OnUnconfirmed(const Member& member);
  /// `patience`: as EndedExchange has it.
  void OnLate(const Member& member, Duration lateness, Duration patience);
  void OnSecondReply(const Member& member);

  /// A task has ended, all its repeats included.
  void OnTask(const Member& member, bool answered);
  /// A poll has ended; `missed`: an exchange of it has failed, as before a repeat.
  void OnPoll(const Device& device, std::size_t query, bool answered, bool missed);
  /// Its queries have changed.
  void OnPlan(const Device& device);
  /// A command has ended; `read_back`: the device shows what was written.
  void OnWrite(const Member& member, WriteEnd end, bool read_back);
  void OnOffline(const Member& member);

  /// The device speaks unasked.
  void OnSpeaks(const Member& member);
  /// It has sent something, with this outcome.
  void OnUnasked(const Member& member, Outcome outcome, const std::string& reason);
  void OnLostEvents(const Member& member, std::size_t events);

 private:
  struct Entry {
    Duration busy{};           // line time that it has taken
    Duration counted{};        // of that, in the status
    Duration drained{};        // line time of the silence after its last exchange
    Instant heard{};           // end of its last exchange, or when the port was opened
    bool out = false;          // its last task has failed
    std::uint32_t missed = 0;  // of its periods
    Duration patience{};       // as the status has it
    std::uint32_t behind = 0;  // as the status has it
    bool told_second = false;  // the user has been warned of a second, different reply
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

// How long one fast round of all polled devices of a line takes: the point store derives the age
// limits of fast values from it. Driven by gateway/bus/jobs/device_tracker.cpp and
// gateway/bus/jobs/job.cpp.
class FastRounds {
 public:
  /// All references outlive it.
  FastRounds(const Roster& roster, PointStore& store) : roster_(roster), store_(store) {}

  struct Poll {
    Duration wire{};
    bool answered = false;
    bool last_of_round = false;
  };
  /// A poll of the fast group has ended. Failures, retries and waiting say nothing about how long a
  /// round takes: an outage must not make old values look younger.
  void OnPoll(const Member& member, const Poll& poll, Instant now);
  /// Its queries have changed.
  void OnPlan(const Device& device);
  /// One of the devices has come or gone.
  void Measure(Instant now) const;

 private:
  struct Entry {
    bool clean = true;  // nothing has failed in the round under way
    Duration wire{};    // its line time so far
    Duration last{};    // line time of the last whole round
  };

  const Roster& roster_;
  PointStore& store_;
  ByMember<Entry> entries_;
};

struct Accounts {
  /// `line_index`: in the store. All references outlive it.
  Accounts(const Roster& roster, const Schedule& schedule, PointStore& store,
           std::uint32_t line_index, PollerListener& listener)
      : line(store, line_index, listener),
        devices(roster, schedule, store, listener),
        states(roster, store, listener),
        rounds(roster, store) {}

  /// Time has passed; `busy`: the line was busy, with `member` if that is known. `drains`: it kept
  /// silence after an exchange of that member.
  void OnTime(Now now, bool busy, const Member* member, bool drains = false) {
    const Duration took = line.OnTime(now, busy, drains);
    devices.OnTime(now, member, took, drains);
    states.OnTime(now);
  }
  /// The port has opened.
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
