// The newest events that are on the disk, as samples: what gateway/dds/event_sender.h takes from.
// gateway/daemon joins it with gateway/events/event_feed.h.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <functional>
#include <vector>

#include "gateway/dds/samples.h"

namespace baudgate::dds {

/// From any thread; nothing waits for the disk.
class EventSupply {
 public:
  virtual ~EventSupply() = default;
  /// Those behind the number `after`, in their order, at most `most`. One without `gateway` is not
  /// published: its device is no longer configured.
  virtual std::vector<EventSample> Take(std::uint64_t after, std::size_t most) const = 0;
  virtual std::uint64_t newest() const = 0;  ///< 0: none, or not known yet
  /// `wake`, on any thread, when there are more; null: no longer, and no call is under way when
  /// this returns.
  virtual void OnNew(std::function<void()> wake) = 0;
};

}  // namespace baudgate::dds
