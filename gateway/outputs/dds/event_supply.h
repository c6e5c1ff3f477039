// The events and alarms that are on the disk, as samples: what gateway/outputs/dds/event_sender.h
// takes from. gateway/daemon joins it with gateway/records/events/event_feed.h.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <vector>

#include "gateway/outputs/dds/samples.h"

namespace baudgate::dds {

/// From any thread; nothing waits for the disk.
class EventSupply {
 public:
  virtual ~EventSupply() = default;
  /// Those after the number `after`, in their order, at most `most`. None also where
  /// they have to be fetched first; OnNew is told then. One without `gateway` is not
  /// published: its device is no longer configured.
  virtual std::vector<EventSample> Take(std::uint64_t after, std::size_t most) = 0;
  virtual std::uint64_t newest() const = 0;  ///< 0: none, or not known yet

  struct Place {
    std::uint64_t seq = 0;
    bool sure = false;  ///< subscribers have confirmed all up to there
  };
  /// The place last given to Keep, kept over a restart; empty: none was. Known with newest().
  virtual std::optional<Place> place() const { return std::nullopt; }
  virtual void Keep(Place /*place*/) {}
  struct Alarm {
    std::uint64_t version = 0;  ///< counts the changes of all alarms, since the start
    AlarmSample sample{};
  };
  /// Those that have changed after this version, as they are now, by their versions; 0: all.
  virtual std::vector<Alarm> TakeAlarms(std::uint64_t /*after*/, std::size_t /*most*/) {
    return {};
  }

  /// `wake`, on any thread, when there are more; null: no longer, and no call is under way when
  /// this returns.
  virtual void OnNew(std::function<void()> wake) = 0;
};

}  // namespace baudgate::dds
