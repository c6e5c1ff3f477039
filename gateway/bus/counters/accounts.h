// `Accounts` groups the data that the status shows of one serial line: the counts of the line
// (`LineAccount`, line_account.h), the counts of each device (`DeviceAccounts`), the state of each
// device (`DeviceStates`, gateway/bus/devices/device_states.h), and the duration of a cycle of
// polls over all devices (`FastRounds`).
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

// `DeviceAccounts` counts for each device of a line how its exchanges, polls and writes ended, and
// how much line time they took. It writes the counts to the point store. DeviceTracker and jobs
// call it.
class DeviceAccounts final : public ExchangeObserver {
 public:
  /// All references must stay valid for the lifetime of this object.
  DeviceAccounts(const Roster& roster, const Schedule& schedule, PointStore& store,
                 PollerListener& listener)
      : roster_(roster), schedule_(schedule), store_(store), listener_(listener) {}

  /// Reports that time has passed until `now`. `took`: the part in which the line was busy with
  /// `member`. `member` is null if no device is known. `drains`: the line kept silence after an
  /// exchange of that member.
  void OnTime(Now now, const Member* member, Duration took, bool drains);
  void OnOpened();

  void OnExchange(const EndedExchange& ended, Now now) override;
  /// The request was not sent, because the conversation could not build it.
  void OnUnsupported(const Member& member, const std::string& reason);
  void OnRetry(const Member& member);
  /// A reading was suspicious, so it is accepted only if a second reading agrees.
  void OnRecheck(const Member& member);
  void OnUnconfirmed(const Member& member);
  /// A late reply came. `patience`: for how much longer than its reply time the line waits for the
  /// member.
  void OnLate(const Member& member, Duration lateness, Duration patience);
  void OnSecondReply(const Member& member);

  /// A task (all requests and retries of one job) has ended.
  void OnTask(const Member& member, bool answered);
  /// A poll has ended. `missed`: at least one of its exchanges failed, even if a retry was
  /// answered.
  void OnPoll(const Device& device, std::size_t query, bool answered, bool missed);
  void OnPlan(const Device& device);
  /// A write command has ended. `read_back`: a read has shown the written value.
  void OnWrite(const Member& member, WriteEnd end, bool read_back);
  void OnOffline(const Member& member);

  void OnSpeaks(const Member& member);
  void OnUnasked(const Member& member, Outcome outcome, const std::string& reason);
  void OnLostEvents(const Member& member, std::size_t events);

 private:
  struct Entry {
    Duration busy{};     // line time that this device has taken
    Duration counted{};  // part of `busy` that the status contains already
    // Line time of the silence that the line kept after the device's last exchange.
    Duration drained{};
    Instant heard{};   // end of the last exchange with the device, or when the port was opened
    bool out = false;  // the last task has failed, and no exchange was answered since
    std::uint32_t missed = 0;  // skipped poll periods so far (Schedule::Missed)
    Duration patience{};       // DeviceStatus::patience as last published
    std::uint32_t behind = 0;  // DeviceStatus::behind as last published
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

// `FastRounds` measures the line time of one round: each polled device of a line has been asked all
// queries of its fast group once. The point store derives the age limits of fast values from this
// time. DeviceTracker and jobs call it.
class FastRounds {
 public:
  /// All references must stay valid for the lifetime of this object.
  FastRounds(const Roster& roster, PointStore& store) : roster_(roster), store_(store) {}

  struct Poll {
    Duration wire{};
    bool answered = false;
    bool last_of_round = false;
  };
  /// A poll of the fast group has ended. Only the line time of rounds without a failed poll counts,
  /// because a longer round makes the point store accept older values.
  void OnPoll(const Member& member, const Poll& poll, Instant now);
  void OnPlan(const Device& device);
  /// Publishes the sum of the last rounds of all devices. Call when a device of the line has gone
  /// offline or returned.
  void Measure(Instant now) const;

 private:
  struct Entry {
    bool clean = true;  // no poll of the device has failed in the present round
    Duration wire{};    // line time of the device in the present round so far
    Duration last{};    // line time of the device in its last complete round
  };

  const Roster& roster_;
  PointStore& store_;
  ByMember<Entry> entries_;
};

struct Accounts {
  /// `line_index`: index of the line in the point store. All references must stay valid for the
  /// lifetime of this object.
  Accounts(const Roster& roster, const Schedule& schedule, PointStore& store,
           std::uint32_t line_index, PollerListener& listener)
      : line(store, line_index, listener),
        devices(roster, schedule, store, listener),
        states(roster, store, listener),
        rounds(roster, store) {}

  /// Reports that time has passed until `now`. `busy`: the line was busy with `member` (null: no
  /// device is known). `drains`: the line kept silence after an exchange of that member.
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
