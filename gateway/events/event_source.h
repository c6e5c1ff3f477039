// What others may ask of the events: gateway/status and gateway/control. From any thread.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "gateway/events/event_page.h"
#include "gateway/state/disk.h"

namespace baudgate::events {

struct EventsState {
  Disk disk = Disk::opening;
  std::string trouble;         ///< why it fails; empty: it does not
  WallTime since{};            ///< of `disk`
  std::size_t waiting = 0;     ///< devices that are not asked for more until theirs are kept
  std::int64_t newest = 0;     ///< number of the last that is kept; 0: none is
  std::uint64_t repeats = 0;   ///< that came once more, since the start
  std::uint64_t left_out = 0;  ///< of the gateway's own, too many of one kind, since the start
  std::string file;
};

class EventSource {
 public:
  virtual ~EventSource() = default;
  virtual EventsState state() const = 0;
  /// Nothing while the file is being opened.
  virtual Result<Page> Read(const PageQuery& query) const = 0;
};

}  // namespace baudgate::events
