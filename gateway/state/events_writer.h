// The one thread that writes events.db. The audit and the events have a connection each, and their
// workers take turns on this thread: SQLite never tells one of them that the file is busy, and the
// audit waits for one commit of the events at most, however many events are queued.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <functional>

#include "gateway/base/worker.h"

namespace baudgate {

struct EventsWriter {
  /// What must be so before the file is opened: its folder is there, and ours. Empty: nothing.
  std::function<Status()> ready;
  /// How often the file has been put aside. Of the thread.
  std::uint64_t times_put_aside = 0;
  WorkThread thread{"events.db"};
};

}  // namespace baudgate
