// The one thread that writes events.db. The audit and the events have a connection each, and their
// workers take turns on this thread: SQLite never tells one of them that the file is busy, and the
// audit waits for one commit of the events at most, however many events are queued.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>
#include <string>

#include "gateway/base/worker.h"

namespace baudgate {

struct EventsWriter {
  /// What must be so before the file is opened: its folder is there, and ours. Empty: nothing.
  std::function<Status()> ready;
  // Used by the thread only:
  std::uint64_t times_put_aside = 0;  ///< the file
  std::size_t open = 0;               ///< connections
  /// All connections have to be closed before one is opened: they share an index of the log that is
  /// wrong.
  struct Closing {
    std::string why{};
    bool lost = false;  ///< records that were in the log
  };
  std::optional<Closing> closing{};
  WorkThread thread{"events.db"};
};

}  // namespace baudgate
