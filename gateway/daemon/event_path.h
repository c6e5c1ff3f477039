// The way of an event from its line to the file, and back the leave to ask for more. Made and ended
// by daemon.cpp.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <memory>
#include <vector>

#include "config/model/config.h"
#include "gateway/daemon/events_place.h"
#include "gateway/events/event_feed.h"
#include "gateway/events/event_log.h"
#include "gateway/poll/poller_listener.h"

namespace baudgate {

/// Some device of the gateway is asked for events.
bool AsksForEvents(const config::Config& config);

class EventPath {
 public:
  /// `kept`: events of this device are on the disk; called on a thread of its own. `config`
  /// outlives it.
  EventPath(const config::Config& config, const EventsPlace& place,
            std::function<void(std::uint32_t device)> kept);

  /// From any thread.
  void Take(ReportedEvents reported);
  events::EventLog& log() { return log_; }
  /// What is on the disk, for outputs, which may keep it longer than this lives.
  std::shared_ptr<events::EventFeed> feed() const { return feed_; }

 private:
  struct Place {
    const config::Line* line = nullptr;
    const config::Device* device = nullptr;
  };

  std::vector<Place> places_;  // by device
  const std::shared_ptr<events::EventFeed> feed_ = std::make_shared<events::EventFeed>();
  events::EventLog log_;
};

}  // namespace baudgate
