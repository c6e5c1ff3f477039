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

// `WaitingAck` is an acknowledgement that waits for the disk. `done` is called when it is saved, or
// with the reason why it is not saved.
struct WaitingAck {
  std::size_t alarms = 0;
  WallTime at{};
  std::function<void(const Acknowledged&)> done;
};

/// Calls `done` of each acknowledgement; the caller must hold no lock. `trouble`: why the
/// acknowledgements are not on the disk; empty: the acknowledgements are saved.
void AnswerAcks(const std::vector<WaitingAck>& acks, const std::string& trouble);

// `WatchedAlarms` ends active alarms that the configuration no longer contains, because they would
// be active for ever, and updates the priorities of active alarms.

std::optional<config::AlarmPriority> PriorityOf(const config::Config& config, const Alarm& alarm);

/// Returns the priority of an alarm in the configuration; nothing if the configuration no longer
/// contains the alarm. If the function is empty, all alarms stay as they are.
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

  /// Adds events that end the alarms which the configuration no longer contains, or that change the
  /// priorities of alarms.
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
  bool tells_own = false;  ///< true: the gateway's own events are stored, too
  Watched watches{};
  /// Called on the writing thread when the last batches of these sources are on the disk, so that
  /// the sources can be asked for more events.
  std::function<void(const std::vector<Source>& sources)> kept;
  /// Called on the writing thread with events on the disk whose records are still to be read: when
  /// the file first opens, and after a commit, before `kept`. Empty: records are not read.
  std::function<void(const std::vector<OwedRecord>& owed)> owed{};
  /// Called once for each change of an alarm, also while the disk fails, on the writing thread or
  /// from EventLog::Watch. `raised`: true if this change has raised the alarm. Can be empty.
  std::function<void(const Alarm& alarm, bool raised)> alarm{};
  /// These receive one line for the log, on any thread: `warn` for example when the disk begins to
  /// fail, `inform` when the disk works again.
  std::function<void(const std::string&)> warn;
  std::function<void(const std::string&)> inform;
};

// `PendingEvents` contains the events that wait for the disk, the acknowledgements that wait for
// these events, and the condition of the disk. EventQueue (input) and EventRounds (output,
// gateway/records/events/event_log.h) share it: both hold the mutex whenever they use it.
struct PendingEvents {
  PendingEvents(const LogOptions& options, std::function<void()> wake_writer)
      : wake(std::move(wake_writer)),
        numbers(options.sources),
        watched(options.watches),
        disk(options.clocks().wall) {}

  bool IsIdle() const BAUDGATE_REQUIRES(mutex) {
    return !disk.is_opening() && book.empty() && records.empty() && !run.waits() && !watched.due();
  }
  /// Returns the alarms as they are on the disk. While the disk is stalled or failing, returns them
  /// as they will be after the next commit.
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
  /// Adds an event of the gateway. If too many events of its kind have come, leaves it out; see
  /// Shares.
  void Tell(EventRecord record);
  /// Stores a record with all its values in one commit. A record that is already in the file is not
  /// written again. If too many records wait for the disk, the record is lost.
  void Keep(KeptRecord record);
  /// Adds the event for the start of the gateway, if own events are stored. It comes before all
  /// other events, and its text contains how the previous run ended. Without a start event, the run
  /// has no end event.
  void Started(const std::string& version);
  /// Adds the event for the end of this run, and events for what Shares has left out. A second call
  /// adds no end event.
  void TellEnd();
  /// Adds the event for the end as TellEnd does, and waits so that outputs can see it. Returns when
  /// nothing waits for the disk, when the disk is in trouble, or after `most`.
  void End(Duration most);
  std::size_t Acknowledge(const AckQuery& query, std::function<void(const Acknowledged&)> done);
  /// Calls `opened` once when the file is open: at once, or later on the writing thread.
  void WhenOpened(std::function<void()> opened);
  bool opened() const;
  /// Applies a reload: gives all sources their new numbers. Stored data refers to the names of a
  /// source, so it stays with the source, also during a commit. Active alarms for which `watches`
  /// returns nothing end.
  void Renumber(SourceNames sources, Watched watches);

  /// Returns the text (EventBatch::said) of the source's last batch in the file. Valid when the
  /// file is open.
  std::string said(Source source) const;
  EventsState state() const;
  std::vector<Alarm> Alarms() const;

 private:
  const LogOptions& options_;
  PendingEvents& pending_;
};

}  // namespace baudgate::events
