// Which events each client is shown of each unit: it writes the number of the first one, and reads
// the block of gateway/outputs/modbus/registers/event_block.h. On the server's thread.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <utility>

#include "gateway/outputs/modbus/registers/event_block.h"
#include "gateway/records/events/event_feed.h"

namespace baudgate::modbus {

class EventWindow {
 public:
  /// Null: no events are kept.
  explicit EventWindow(std::shared_ptr<const events::EventFeed> events)
      : events_(std::move(events)) {}

  /// `first`: the number of an event; 0: the newest are shown.
  void SetFirst(std::uint64_t client, std::uint8_t unit, std::uint32_t first) {
    firsts_[{client, unit}] = first;
  }
  /// `source`: the device whose events are shown; empty: the events of all.
  EventBlock Show(std::uint64_t client, std::uint8_t unit,
                  std::optional<events::Source> source) const;
  /// The client has left.
  void Forget(std::uint64_t client);

 private:
  const std::shared_ptr<const events::EventFeed> events_;
  /// By client and unit; none: the newest.
  std::map<std::pair<std::uint64_t, std::uint8_t>, std::uint32_t> firsts_;
};

}  // namespace baudgate::modbus
