// The way of an event from its line to the file, and back the leave to ask for more. Made and ended
// by daemon.cpp.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <memory>
#include <vector>

#include "config/model/config.h"
#include "gateway/daemon/events_place.h"
#include "gateway/events/event_log.h"
#include "gateway/poll/poller_listener.h"

namespace baudgate {

/// Some device of the gateway is asked for events.
bool AsksForEvents(const config::Config& config);

class EventPath {
 public:
  /// `said` of the device's last events that are on the disk (see Conversation::OnEventsKept):
  /// `reported` by Take, or from before the start. On a thread of its own, or from Start.
  using Kept = std::function<void(std::uint32_t device, std::string said, bool reported)>;
  /// `config` outlives it.
  EventPath(const config::Config& config, const EventsPlace& place, Kept kept);

  /// The lines can hear what is kept from before, as soon as the file is open.
  void Start();
  /// From any thread.
  void Take(ReportedEvents reported);
  events::EventLog& log() { return log_; }

 private:
  struct Place {
    const config::Line* line = nullptr;
    const config::Device* device = nullptr;
  };

  const Kept kept_;
  std::vector<Place> places_;  // by device
  events::EventLog log_;
};

}  // namespace baudgate
