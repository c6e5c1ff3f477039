// The events that wait for the disk, the clients that wait for these events, and the condition of
// the disk. Shared by gateway/records/events/event_queue.h, the way in, and
// gateway/records/events/event_rounds.h, the way out: both hold the mutex whenever they use it.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <condition_variable>
#include <cstdint>
#include <functional>
#include <utility>
#include <vector>

#include "gateway/base/guarded.h"
#include "gateway/records/disk/disk_condition.h"
#include "gateway/records/events/event_book.h"
#include "gateway/records/events/kept_record.h"
#include "gateway/records/events/log_options.h"
#include "gateway/records/events/own_run.h"
#include "gateway/records/events/source_numbers.h"
#include "gateway/records/events/waiting_ack.h"
#include "gateway/records/events/watched.h"

namespace baudgate::events {

struct PendingEvents {
  PendingEvents(const LogOptions& options, std::function<void()> wake_writer)
      : wake(std::move(wake_writer)),
        numbers(options.sources),
        watched(options.watches),
        disk(options.clocks().wall) {}

  /// The file is open, and nothing waits to be written.
  bool IsIdle() const BAUDGATE_REQUIRES(mutex) {
    return !disk.is_opening() && book.empty() && records.empty() && !run.waits() && !watched.due();
  }
  /// Alarms as they are on the disk. While the disk is in trouble: as they will be there.
  std::vector<Alarm> Alarms() const BAUDGATE_REQUIRES(mutex) {
    return book.Alarms(disk.holds_up());
  }

  /// Wakes the writing thread.
  const std::function<void()> wake;
  Mutex mutex;
  std::condition_variable changed;  ///< a round has ended, or the disk has stalled
  EventBook book BAUDGATE_GUARDED_BY(mutex);
  std::vector<KeptRecord> records BAUDGATE_GUARDED_BY(mutex);
  std::vector<WaitingAck> acks BAUDGATE_GUARDED_BY(mutex);
  OwnRun run BAUDGATE_GUARDED_BY(mutex);
  SourceNumbers numbers BAUDGATE_GUARDED_BY(mutex);
  WatchedAlarms watched BAUDGATE_GUARDED_BY(mutex);
  DiskCondition disk BAUDGATE_GUARDED_BY(mutex);
  std::int64_t oldest BAUDGATE_GUARDED_BY(mutex) = 0;  ///< number of the first event in the file
  std::function<void()> on_opened BAUDGATE_GUARDED_BY(mutex);  ///< see EventQueue::WhenOpened
};

}  // namespace baudgate::events
