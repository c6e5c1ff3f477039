// Takes over the content of replies: readings go to the point store, events to the listener, which
// saves them. What else follows is returned to gateway/poll/effect_applier.h.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "gateway/poll/effects.h"
#include "gateway/poll/event_delivery.h"
#include "gateway/poll/job.h"
#include "gateway/poll/poller_listener.h"
#include "gateway/poll/roster.h"
#include "gateway/poll/speaker.h"
#include "gateway/store/point_store.h"

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
