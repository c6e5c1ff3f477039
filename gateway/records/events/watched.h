// Which alarms the configuration still watches, and with which priority: one that nobody watches
// would be active for ever.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <optional>
#include <utility>

#include "config/model/config.h"
#include "gateway/records/events/alarm.h"
#include "gateway/records/events/event_book.h"

namespace baudgate::events {

/// Empty: it can be neither raised nor ended any more.
std::optional<config::AlarmPriority> PriorityOf(const config::Config& config, const Alarm& alarm);

/// The priority of an alarm in the configuration; empty: the configuration no longer has it.
/// Without a function all alarms stay as they are.
using Watched = std::function<std::optional<config::AlarmPriority>(const Alarm&)>;

/// Brings alarms into line with the configuration. No lock: gateway/records/events/pending_events.h
/// has it.
class WatchedAlarms {
 public:
  explicit WatchedAlarms(Watched watched) : watched_(std::move(watched)) {}

  /// A reload.
  void Renew(Watched watched) {
    watched_ = std::move(watched);
    due_ = true;
  }
  /// Follow is to be called, behind what was told up to now.
  bool due() const { return due_; }
  bool TakeDue() { return std::exchange(due_, false); }
  void SetDue() { due_ = true; }

  /// Ends what nobody watches any more, and changes priorities: by events into the book.
  void Follow(EventBook& book, WallTime at) const;

 private:
  Watched watched_;
  bool due_ = false;
};

}  // namespace baudgate::events
