// Takes over the content of replies: readings go to the point store, events to the listener, which
// saves them. What else follows is returned to gateway/bus/jobs/effect_applier.h.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "gateway/bus/devices/poller_listener.h"
#include "gateway/bus/devices/roster.h"
#include "gateway/bus/jobs/job.h"
#include "gateway/bus/jobs/speaker.h"
#include "gateway/bus/points/point_store.h"
#include "gateway/bus/schedule/effects.h"
#include "gateway/bus/schedule/event_delivery.h"

namespace baudgate {

class Intake {
 public:
  /// Both outlive it; `listener` may be made later than this.
  Intake(PointStore& store, PollerListener& listener) : store_(store), listener_(listener) {}

  /// The answer to a request of `job`, which belongs to `device`.
  ReplyEffects Take(const Job& job, Device& device, Answer answer, Instant now);
  /// A message that a device has sent unasked.
  void TakeUnasked(const Device& device, Speaker::Said said);
  /// See EventDelivery.
  Schedule::Brought OnKept(const Device& device, const std::string& said) {
    return delivery_.OnKept(device, said);
  }
  /// It was asked at `asked` or later, and has no events that are not kept.
  void OnDrained(const Device& device, Instant asked) { listener_.OnDrained(device.index, asked); }
  void OnReplaced(const Device& device) { delivery_.OnReplaced(device); }

 private:
  void Store(const Job& job, Device& device, const Answer& answer, Instant now,
             ReplyEffects& effects);
  void Report(const Job& job, const Device& device, EventBatch batch, ReplyEffects& effects);

  PointStore& store_;
  PollerListener& listener_;
  EventDelivery delivery_;
};

}  // namespace baudgate
