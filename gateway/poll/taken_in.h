// Groups the parts that take in replies, and messages that a device sends unasked: from there they
// go to the store, and to the listener, which keeps events. For gateway/poll/poller.h.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include "gateway/poll/effect_applier.h"
#include "gateway/poll/intake.h"
#include "gateway/poll/line_knowledge.h"
#include "gateway/poll/poller_listener.h"
#include "gateway/poll/unasked_side.h"
#include "gateway/store/point_store.h"

namespace baudgate {

struct TakenIn {
  /// All outlive it.
  TakenIn(LineKnowledge& knows, PointStore& store, PollerListener& listener)
      : intake(store, listener),
        replies(knows.owed, knows.agenda, knows.ledger, knows.upkeep, intake),
        unasked(knows.roster, knows.ledger, knows.upkeep, intake) {}

  Intake intake;
  EffectApplier replies;
  UnaskedSide unasked;
};

}  // namespace baudgate
