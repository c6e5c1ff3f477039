// Groups the parts that take in replies, and messages that a device sends unasked: from there they
// go to the store, and to the listener, which keeps events. For gateway/bus/poller/poller.h.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "gateway/bus/devices/poller_listener.h"
#include "gateway/bus/jobs/effect_applier.h"
#include "gateway/bus/jobs/intake.h"
#include "gateway/bus/jobs/line_knowledge.h"
#include "gateway/bus/points/point_store.h"
#include "gateway/bus/poller/unasked_side.h"

namespace baudgate {

struct TakenIn {
  /// All outlive it.
  TakenIn(LineKnowledge& knows, LineObserver& observer, PointStore& store, PollerListener& listener)
      : intake(store, listener),
        replies(knows.owed, knows.agenda, knows.ledger, knows.upkeep, intake),
        unasked(knows.roster, observer, knows.ledger, knows.upkeep, intake) {}

  Intake intake;
  EffectApplier replies;
  UnaskedSide unasked;
};

}  // namespace baudgate
