// Groups all that a line knows: its members, the replies that they owe, all that waits to be asked,
// the accounts for the status, and the part that keeps these in step when a device comes or goes.
// For gateway/bus/poller/poller.h.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

#include "config/model/line.h"
#include "gateway/bus/counters/ledger.h"
#include "gateway/bus/devices/poller_listener.h"
#include "gateway/bus/devices/roster.h"
#include "gateway/bus/jobs/agenda.h"
#include "gateway/bus/jobs/upkeep.h"
#include "gateway/bus/points/point_store.h"
#include "gateway/bus/replies/owed_replies.h"

namespace baudgate {

struct LineKnowledge {
  /// See Poller.
  LineKnowledge(const config::Line& line, std::uint32_t first_device,
                const Roster::FindProtocol& find, PointStore& store, PollerListener& listener)
      : roster(line, first_device, find),
        owed(roster),
        agenda(roster, owed.late),
        ledger(roster, agenda.schedule, store, store.LineIndex(line), listener),
        upkeep(roster, store, owed, agenda, ledger) {}

  Roster roster;
  OwedReplies owed;
  Agenda agenda;
  Ledger ledger;
  Upkeep upkeep;
};

}  // namespace baudgate
