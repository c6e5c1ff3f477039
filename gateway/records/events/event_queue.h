// `EventQueue` accepts all events, and shows the state of the event log. Thread-safe. No call waits
// for the disk, except End. gateway/records/events/event_log.h writes the events.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <condition_variable>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "config/model/config.h"
#include "gateway/base/guarded.h"
#include "gateway/records/disk/disk.h"
#include "gateway/records/disk/events_file.h"
#include "gateway/records/events/alarm.h"
#include "gateway/records/events/event_book.h"
#include "gateway/records/events/event_feed.h"
#include "gateway/records/events/event_file.h"
#include "gateway/records/events/event_record.h"
#include "gateway/records/events/event_source.h"
#include "gateway/records/events/own_records.h"

namespace baudgate::events {

// An acknowledgement that waits for the disk. `done` gets the reason if it is not saved.
struct WaitingAck {
  std::size_t alarms = 0;
  WallTime at{};
  std::function<void(const Acknowledged&)> done;
};

/// The caller must hold no lock. `trouble` empty: the acknowledgements are saved.
void AnswerAcks(const std::vector<WaitingAck>& acks, const std::string& trouble);

// `WatchedAlarms` ends active alarms that the configuration no longer contains, because they would
// be active for ever, and updates priorities.

std::optional<config::AlarmPriority> PriorityOf(const config::Config& config, const Alarm& alarm);

/// Returns nothing if the configuration no longer contains the alarm. Empty: all alarms stay.
using Watched = std::function<std::optional<config::AlarmPriority>(const Alarm&)>;

class WatchedAlarms {
 public:
  explicit WatchedAlarms(Watched watched) : watched_(std::move(watched)) {}

  void Renew(Watched watched) {
    watched_ = std::move(watched);
    due_ = true;
  }
  /// True if Follow must be called after all events that wait now are written.
  bool due() const { return due_; }
  bool TakeDue() { return std::exchange(due_, false); }
  void SetDue() { due_ = true; }

  /// Adds events that end alarms or change their priorities.
  void Follow(EventBook& book, WallTime at) const;

 private:
  Watched watched_;
  bool due_ = false;
};

struct LogOptions {
  std::filesystem::path file;  ///< empty: no file; see `why_no_file` and `in_memory`
  std::string why_no_file{};
  /// True: no file is used, and events exist until the program ends.
  bool in_memory = false;
  std::string vfs{};
  /// The writing thread of events.db, shared with the audit. Null: EventLog makes one.
  std::shared_ptr<records::EventsWriter> writer{};
  SourceNames sources;
  std::function<Now()> clocks;
  std::shared_ptr<EventFeed> feed{};  ///< receives events that are on the disk; null: no feed
  std::shared_ptr<CursorBook> cursors{};
  bool tells_own = false;  ///< true: the gateway's own events are stored as well
  Watched watches{};
  /// Called on the writing thread when the sources' last batches are on the disk.
  std::function<void(const std::vector<Source>& sources)> kept;
  /// Called on the writing thread with events on the disk whose records are still to be read: when
  /// the file first opens, and after a commit, before `kept`. Empty: records are not read.
  std::function<void(const std::vector<OwedRecord>& owed)> owed{};
  /// Called once for each change of an alarm, also while the disk fails, on the writing thread or
  /// from Watch. `raised`: true if this change has raised the alarm. Can be empty.
  std::function<void(const Alarm& alarm, bool raised)> alarm{};
  /// Called on any thread: `warn` when the disk begins to fail, `inform` when it works again.
  std::function<void(const std::string&)> warn;
  std::function<void(const std::string&)> inform;
};

// The events that wait for the disk, and the condition of the disk. EventQueue (input) and
// EventRounds (output) share it: both hold the mutex whenever they use it.
struct PendingEvents {
  PendingEvents(const LogOptions& options, std::function<void()> wake_writer)
      : wake(std::move(wake_writer)),
        numbers(options.sources),
        watched(options.watches),
        disk(options.clocks().wall) {}

  bool IsIdle() const BAUDGATE_REQUIRES(mutex) {
    return !disk.is_opening() && book.empty() && records.empty() && !run.waits() && !watched.due();
  }
  /// While the disk is in trouble, returns the alarms as after the next commit.
  std::vector<Alarm> Alarms() const BAUDGATE_REQUIRES(mutex) {
    return book.Alarms(disk.holds_up());
  }

  const std::function<void()> wake;
  Mutex mutex;
  std::condition_variable changed;  ///< notified when a round has ended, or the disk has stalled
  EventBook book BAUDGATE_GUARDED_BY(mutex);
  std::vector<KeptRecord> records BAUDGATE_GUARDED_BY(mutex);
  std::vector<WaitingAck> acks BAUDGATE_GUARDED_BY(mutex);
  OwnRun run BAUDGATE_GUARDED_BY(mutex);
  SourceNumbers numbers BAUDGATE_GUARDED_BY(mutex);
  WatchedAlarms watched BAUDGATE_GUARDED_BY(mutex);
  records::DiskCondition disk BAUDGATE_GUARDED_BY(mutex);
  std::int64_t oldest BAUDGATE_GUARDED_BY(mutex) = 0;
  std::function<void()> on_opened BAUDGATE_GUARDED_BY(mutex);
};

class EventQueue {
 public:
  /// `options` and `pending` must outlive this object.
  EventQueue(const LogOptions& options, PendingEvents& pending)
      : options_(options), pending_(pending) {}

  /// Adds a batch of a device; `line` and `device` of the batch must be set.
  void Add(Batch batch);
  /// Too many events of its kind are left out; see Shares.
  void Tell(EventRecord record);
  /// Stores a record with all its values in one commit. A record that is already in the file is not
  /// written again. If too many records wait for the disk, the record is lost.
  void Keep(KeptRecord record);
  /// Comes before all other events; its text contains how the previous run ended. Without a start
  /// event, the run has no end event.
  void Started(const std::string& version);
  /// A second call adds no end event.
  void TellEnd();
  /// Waits until nothing waits for the disk, the disk is in trouble, or for `most`.
  void End(Duration most);
  std::size_t Acknowledge(const AckQuery& query, std::function<void(const Acknowledged&)> done);
  /// Calls `opened` once when the file is open: at once, or later on the writing thread.
  void WhenOpened(std::function<void()> opened);
  bool opened() const;
  /// Gives all sources their new numbers; stored data stays with the names. Active alarms for which
  /// `watches` returns nothing end.
  void Renumber(SourceNames sources, Watched watches);

  /// EventBatch::said of the last batch in the file, which must be open.
  std::string said(Source source) const;
  EventsState state() const;
  std::vector<Alarm> Alarms() const;

 private:
  const LogOptions& options_;
  PendingEvents& pending_;
};

}  // namespace baudgate::events
