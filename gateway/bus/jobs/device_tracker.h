// `DeviceTracker` updates all that is known of a device after each exchange, and when a device goes
// offline, returns, or may have been replaced: its queries, its schedule, its state, and which of
// its values are uncertain.
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
  /// Call when the port has closed, after the end of the job under way.
  void OnClosed(Instant now);
  /// A telegram that a user sent by hand got no reply. The reply may come later and look like the
  /// reply to a poll of any device, so a probe of each device goes before its polls.
  void OnUnansweredTelegram(Instant now);
  /// A request that may write was sent. `answered`: it was answered; else the device may have
  /// carried it out nevertheless. In each device of this protocol, the points that the request may
  /// change become uncertain and are read again soon. If these points are unknown, the device is
  /// polled again soon; without an answer only its groups `once` and `daily`. `by`, `writes`: the
  /// written device and points; null and empty if a client of a route made the request.
  void OnWritten(const protocols::Protocol& protocol, View request, const Device* by,
                 std::span<const PointWrite> writes, bool answered, Instant now);
  /// Call after a user has sent a telegram by hand. In each device of this protocol, the points
  /// that the telegram may change become uncertain until they are read again; all points if it is
  /// unknown which.
  void OnTelegram(const protocols::Protocol& protocol, View telegram, Instant now);
  /// Call first when an exchange of any kind has ended, before it is counted. Updates what is known
  /// of the member and of late replies, and sets `ended.patience` and `ended.lags`.
  void OnExchange(EndedExchange& ended, Instant now);
  /// A task (a request with its retries) has ended. The member may go offline or return.
  void OnTask(Member& member, Outcome outcome, const std::string& reason, Instant now);
  /// A late reply of the member came. `lateness`: time after the end of its reply time.
  void CountLate(const Member& member, Duration lateness, Instant now);
  void OnUnasked(Device& device, Outcome outcome, const std::string& reason, Instant now);
  /// Another device answers in place of `device`, so no value of the old device is valid.
  void OnReplaced(Device& device, Now now);
  /// Schedules the next background read of the device. Call when the due time of this read may have
  /// changed.
  void PlanBackground(const Device& device);
  /// The device has answered, so its conversation may have found a trouble of the device, such as a
  /// wrong type, or the end of a trouble.
  void OnHeard(Device& device, Instant now);
  /// The conversation of the device has received its saved memory after a restart.
  void OnRecalled(Device& device);
  /// Handles bytes that belong to no exchange, such as a late reply. The result can contain a
  /// warning for the user.
  LateReplies::StrayEffects ApplyStray(const StrayBytes& stray, Instant now);
  void OnSecondReply(Instant now);
  Value KnownValue(const Device& device, std::size_t point, Instant now) const;
  /// As PointStore::OnWritten.
  void OnPointsWritten(const Device& device, const std::vector<std::size_t>& points, Instant now);
  /// Makes these points uncertain until they are read again.
  void Doubt(const Device& device, const std::vector<std::size_t>& points, Instant now);
  void ReadBack(const Device& device, const std::vector<std::size_t>& points);
  void SetInUse(Device& device, bool in_use, bool open, Instant now);
  /// Shows in the status who has taken the device out of use, and the time of this change.
  void NoteUse(const Device& device, const std::string& by, WallTime now);
  /// A user has enabled the device, even if it was enabled before. All its polls are due now.
  void OnEnabled(Device& device, bool open, Instant now);
  /// The queries of the conversation have changed. Polls keep their times: see Schedule::GoOn.
  void GoOnWithPlan(Device& device, Instant now);
  /// The queries of the conversation have changed. All of them are due now.
  void RestartWithPlan(Device& device, Instant now);
  /// A late reply may still come, so polls of the member, and of devices with its address, wait.
  void HoldBack(const Member& member);
  void ShowLine(Instant now) { accounts_.line.Show(agenda_.probes.NoticeBound(now)); }

  /// Schedules a group of queries again, because some of its points could not be read.
  /// * Groups once and daily: after the `slow` period of the device, at most an hour; daily: at
  ///   least 5 min.
  /// * Other groups: after an hour.
  /// `soon`: already after 8 s, then after 16 s and so on, up to the time of the list.
  void Repeat(const Device& device, config::Group group, bool soon, Instant now);

 private:
  /// The points of a device whose values a request may change. Empty: the points are unknown.
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
