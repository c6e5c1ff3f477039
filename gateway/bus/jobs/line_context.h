// `LineContext` groups the parts of one serial line for its jobs: its devices, the replies that may
// still come, the waiting work, the counts for the status, and the parts that update these.
// `Poller` owns it. The fields are constructed in the order of their declaration, and refer to
// fields above them only; `Chooser` refers to all fields.
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
  /// The parameters are those of the constructor of `Poller`.
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

  /// Returns when the last late reply of the member can come; empty: no late reply can come after
  /// `now`.
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
  /// The observers of ended exchanges, in the order in which they are called.
  const std::array<ExchangeObserver*, 3> observers{&accounts.devices, &accounts.line,
                                                   observer.get()};
};

}  // namespace baudgate::bus
