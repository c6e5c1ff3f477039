// `LineContext` groups the parts of a line for its jobs: its members, the replies that may still
// come, the waiting work, the accounts for the status, and the parts that update these.
// gateway/bus/poller/poller.h owns it. Fields are constructed in this order, and refer only to
// fields above them; `Chooser` refers to all of them.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <memory>
#include <optional>

#include "config/model/line.h"
#include "gateway/bus/counters/accounts.h"
#include "gateway/bus/devices/poller_listener.h"
#include "gateway/bus/devices/roster.h"
#include "gateway/bus/jobs/agenda.h"
#include "gateway/bus/jobs/chooser.h"
#include "gateway/bus/jobs/device_tracker.h"
#include "gateway/bus/jobs/intake.h"
#include "gateway/bus/jobs/routed.h"
#include "gateway/bus/points/point_store.h"
#include "gateway/bus/replies/ended_exchange.h"
#include "gateway/bus/replies/whose_reply.h"

namespace baudgate::bus {

struct LineContext {
  /// See Poller.
  LineContext(const config::Line& line, std::uint32_t first_device,
              const Roster::FindProtocol& find, PointStore& store, PollerListener& listener,
              const MakeObserver& observe = {})
      : roster(line, first_device, find),
        observer(observe ? observe(roster, store) : std::make_unique<LineObserver>()),
        owed(roster),
        agenda(roster, owed.late_replies),
        accounts(roster, agenda.schedule, store, store.LineIndex(line), listener),
        tracker(roster, store, owed, agenda, accounts),
        intake(store, listener),
        routed(roster, agenda, owed.late_replies),
        chooser(*this) {}
  LineContext(const LineContext&) = delete;
  LineContext& operator=(const LineContext&) = delete;

  /// Returns when no late reply of the member can come any more; empty: none can come now.
  std::optional<Instant> ClearsAt(const Member& member, Instant now) const {
    const Instant until = owed.late_replies.LateUntil(member);
    return until <= now ? std::nullopt : std::optional(until);
  }

  Roster roster;
  const std::unique_ptr<LineObserver> observer;
  OwedReplies owed;
  Agenda agenda;
  Accounts accounts;
  DeviceTracker tracker;
  Intake intake;
  RoutedJobs routed;
  Chooser chooser;
  /// All observers of ended exchanges, in the order of their calls.
  const std::array<ExchangeObserver*, 3> observers{&accounts.devices, &accounts.line,
                                                   observer.get()};
};

}  // namespace baudgate::bus
