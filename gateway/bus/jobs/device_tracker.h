// `DeviceTracker` applies what an exchange shows about its device, and what follows when a device
// comes, goes, or may have been replaced: its plan of queries, its schedule, its state, and which
// of its values are in doubt.
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
  /// All references must stay valid for the lifetime of this object.
  DeviceTracker(Roster& roster, PointStore& store, OwedReplies& owed, Agenda& agenda,
                Accounts& accounts);

  void OnOpened(Instant now);
  /// Call when the port has closed, and no job is under way any more.
  void OnClosed(Instant now);
  /// A telegram by hand got no reply. A reply of any device may still come, and look like the reply
  /// to a poll, so probes go first.
  void OnUnansweredTelegram(Instant now);
  /// A request that may write was sent, and may have been carried out. The points that show the
  /// change become uncertain, in all configured devices with this address, and are read again soon.
  /// If these points are unknown, all points of the device are read again; after a request that was
  /// not `answered`, only the groups `once` and `daily`. `by`, `writes`: the device and its points,
  /// if the request was a write to points; else null and empty.
  void OnWritten(const protocols::Protocol& protocol, View request, const Device* by,
                 std::span<const PointWrite> writes, bool answered, Instant now);
  /// As OnWritten, for a telegram by hand. If the points that it changes are unknown, all points of
  /// the device are uncertain until they are read again.
  void OnTelegram(const protocols::Protocol& protocol, View telegram, Instant now);
  /// An exchange of any kind has ended. Learns from it before it is counted, and sets `patience`
  /// and `lags` of `ended`.
  void OnExchange(EndedExchange& ended, Instant now);
  /// A task has ended: the member may be offline now, or back.
  void OnTask(Member& member, Outcome outcome, const std::string& reason, Instant now);
  /// A reply of the member has come `lateness` after its reply time.
  void CountLate(const Member& member, Duration lateness, Instant now);
  void OnUnasked(Device& device, Outcome outcome, const std::string& reason, Instant now);
  /// Another device answers in place of `device`: no value of the old device is valid.
  void OnReplaced(Device& device, Now now);
  /// Call when the next background task of the conversation may be due at another time.
  void PlanBackground(const Device& device);
  /// The device has answered: its conversation may have found a trouble of the device, or the end
  /// of it.
  void OnHeard(Device& device, Instant now);
  /// The conversation has got its memory from before a restart.
  void OnRecalled(Device& device);
  /// Bytes came that belong to no exchange. The result may contain a warning for the user.
  LateReplies::StrayEffects ApplyStray(const StrayBytes& stray, Instant now);
  void OnSecondReply(Instant now);
  /// Makes these points uncertain until they are read again.
  void Doubt(const Device& device, const std::vector<std::size_t>& points, Instant now);
  void ReadBack(const Device& device, const std::vector<std::size_t>& points);
  void SetInUse(Device& device, bool in_use, bool open, Instant now);
  /// A person wants the device to be polled now, whether it was in use or not.
  void OnEnabled(Device& device, bool open, Instant now);
  /// The queries of the conversation have changed. The polls continue where they were.
  void GoOnWithPlan(Device& device, Instant now);
  /// The queries of the conversation have changed, and all polls are due.
  void RestartWithPlan(Device& device, Instant now);
  /// A late reply may still come: polls of the member, and of devices with the same address, wait.
  void HoldBack(const Member& member);
  void ShowLine(Instant now) { accounts_.line.Show(agenda_.probes.NoticeBound(now)); }

  /// Reads a group again of which a part was not read: after the slow period, at least every hour;
  /// the daily group as a whole, at most every 5 min. `soon`: after 8 s, 16 s … up to that time.
  void Repeat(const Device& device, config::Group group, bool soon, Instant now);

 private:
  /// Points of the device whose value `request` may change; empty: unknown.
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
