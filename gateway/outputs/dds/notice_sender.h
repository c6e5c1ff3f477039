// Sends what goes before values: the start of the gateway, the ends of points, events and alarms.
// A sample that is refused is tried again a second later. Sans-I/O: time is an argument;
// gateway/outputs/dds/sample_sender.h says when.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "gateway/base/time.h"
#include "gateway/outputs/dds/alarm_sender.h"
#include "gateway/outputs/dds/event_sender.h"
#include "gateway/outputs/dds/paced_writer.h"
#include "gateway/outputs/dds/point_ends.h"

namespace baudgate::dds {

class NoticeSender {
 public:
  /// Subscribers that are already there find a new gateway within this time.
  static constexpr Duration kDiscoveryTime = 500ms;
  /// All subscribers that are running have found a new gateway within this time. Events wait so
  /// long until somebody reads them. If 3,000 events wait and the writer keeps 1,000, sending them
  /// at once would lose the oldest 2,000 before the first reader is found.
  static constexpr Duration kMeetingTime = 15s;

  /// All outlive this. `now` is told as the gateway's start. `events`: null: there
  /// are none.
  NoticeSender(const config::Config& config, const PointStore& store, PacedWriter& paced,
               EventSupply* events, Now now);

  /// `same`: the receiver is the same, and only its writers of samples are others.
  void StartAnew(Instant now, bool same = false);
  PointEnds& ends() { return ends_; }
  DeviceEnds& device_ends() { return device_ends_; }
  bool EndsAreTold() const { return ends_.empty() && device_ends_.empty(); }
  /// Also those that were refused.
  void SendEndsAt(Instant at) { ends_due_ = at; }

  /// At most 64 of each kind. False: the pace or the writer does not allow it now.
  bool Send(Instant now);
  /// When what is left may be sent.
  Instant Due();

  /// Sends the events and alarms until now, as far as the pace allows, for at most 700 ms. Returns
  /// when to go on; empty: all are sent, or cannot be.
  std::optional<Instant> End(Instant now);
  /// Behind End: subscribers have confirmed everything.
  void Confirm() { events_.Confirm(); }

  /// From any thread.
  const EventSender& events() const { return events_; }

 private:
  bool SendGateway(Instant now);
  Instant EventsDue() const;
  template <typename Sender>
  bool SendFrom(Sender& sender, Instant& due, Instant now);
  template <typename Sender>
  std::optional<Instant> EndOf(Sender& sender, Instant now);

  PacedWriter& paced_;
  GatewaySample gateway_;
  Instant gateway_due_;  ///< Instant::max(): it has been sent
  PointEnds ends_;
  DeviceEnds device_ends_;
  Instant ends_due_{};  ///< not before
  EventSender events_;
  Instant events_due_;  ///< not before
  Instant meets_until_;
  AlarmSender alarms_;
  Instant alarms_due_;             ///< not before
  std::optional<Instant> end_by_;  ///< the end is being told
};

}  // namespace baudgate::dds
