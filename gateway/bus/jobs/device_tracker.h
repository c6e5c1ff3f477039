// What every exchange means for its device, and what follows when a device comes, goes, or may be
// another one: its plan, its schedule, its state, and which of its values are in doubt.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "gateway/base/outcome.h"
#include "gateway/bus/counters/accounts.h"
#include "gateway/bus/devices/poller_listener.h"
#include "gateway/bus/devices/roster.h"
#include "gateway/bus/jobs/agenda.h"
#include "gateway/bus/points/point_store.h"
#include "gateway/bus/replies/ended_exchange.h"
#include "gateway/bus/replies/whose_reply.h"
#include "gateway/bus/writes/write_command.h"

namespace baudgate::bus {

class DeviceTracker {
 public:
  /// All references outlive it.
  DeviceTracker(Roster& roster, PointStore& store, OwedReplies& owed, Agenda& agenda,
                Accounts& accounts);

  /// The port has opened.
  void OnOpened(Instant now);
  /// The port has closed, and no job is under way any more.
  void OnClosed(Instant now);
  /// A telegram by hand got no reply. That of any device may still come, and look like one to a
  /// poll: probes go first.
  void OnUnansweredTelegram(Instant now);
  /// A request that may write was sent, and may have been carried out. The points that show the
  /// change, in all entries of the address, are uncertain until they are read again, which is done
  /// soon. If these points are not known, all points of the device are read again; after a request
  /// that was not `answered`, only the groups `once` and `daily`. `by`, `writes`: the device and
  /// its points, if the request was a write to points; else null, and none.
  void OnWritten(const protocols::Protocol& protocol, View request, const Device* by,
                 std::span<const PointWrite> writes, bool answered, Instant now);
  /// The same for a telegram by hand. If the points that it changes are not known, all points of
  /// the device are uncertain until they are read again.
  void OnTelegram(const protocols::Protocol& protocol, View telegram, Instant now);
  /// An exchange has ended, whatever it was for: what the bus learns from it, before it is counted.
  /// Sets what `ended` says of that.
  void OnExchange(EndedExchange& ended, Instant now);
  /// A task has ended: a device may be offline now, or back.
  void OnTask(Member& member, Outcome outcome, const std::string& reason, Instant now);
  /// A reply of the member has come this long after its reply time.
  void CountLate(const Member& member, Duration lateness, Instant now);
  /// It has sent something unasked, with this outcome.
  void OnUnasked(Device& device, Outcome outcome, const std::string& reason, Instant now);
  /// Another device answers in its place: no value of the old one holds.
  void OnReplaced(Device& device, Now now);
  /// The next background task of its conversation may be due at another time now.
  void PlanBackground(const Device& device);
  /// It has answered: its conversation may have found a trouble of the device, or the end of one.
  void OnHeard(Device& device, Instant now);
  /// Its conversation has its memory from before a restart.
  void OnRecalled(Device& device);
  /// Bytes have come that belong to no exchange. May return a warning for the user.
  LateReplies::StrayEffects ApplyStray(const StrayBytes& stray, Instant now);
  /// A second, different reply has come after the one that was taken.
  void OnSecondReply(Instant now);
  /// These points are uncertain until they are read again.
  void Doubt(const Device& device, const std::vector<std::size_t>& points, Instant now);
  /// Reads these points as soon as possible.
  void ReadBack(const Device& device, const std::vector<std::size_t>& points);
  void SetInUse(Device& device, bool in_use, bool open, Instant now);
  /// A person wants it to be polled now, whether it was in use or not.
  void OnEnabled(Device& device, bool open, Instant now);
  /// The queries of its conversation have changed. Its polls go on where they were.
  void GoOnWithPlan(Device& device, Instant now);
  /// The same, and all of its polls are due.
  void RestartWithPlan(Device& device, Instant now);
  /// A late reply may still come: polls of the member, and of entries with the same address, wait.
  void HoldBack(const Member& member);
  void ShowLine(Instant now) { accounts_.line.Show(agenda_.probes.NoticeBound(now)); }

  /// What could not be read once is tried again after the slow period, at least every hour; of the
  /// daily group the whole round, at most every 5 min. `soon`: after 8 s, 16 s … until then.
  void Repeat(const Device& device, config::Group group, bool soon, Instant now);

 private:
  /// Points of the device that may show something else after `request`; empty: not known.
  using Touched = std::optional<std::vector<std::size_t>>;
  static Touched TouchedBy(View request, const Device* by, std::span<const PointWrite> writes,
                           const Device& device);
  void Outdate(const Device& device, const std::vector<std::size_t>& points, Instant now);
  void Charge(const EndedExchange& ended, Instant now);
  void Replan(Device& device, Instant now);
  void Plan(Device& device);
  void Reconnect(Device& device, Instant now);
  void DoubtLatest(Instant now);
  void DoubtAll(const Device& device, Instant now);
  void DoubtSeldom(Device& device, Instant now);

  Roster& roster_;
  PointStore& store_;
  OwedReplies& owed_;
  Agenda& agenda_;
  Accounts& accounts_;
};

}  // namespace baudgate::bus
