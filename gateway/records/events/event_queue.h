// The way in for all events, and the view of those that are not in the file yet. Any thread may
// call it. No call waits for the disk, except End. gateway/records/events/event_log.h is the way
// out. WaitingAck, WatchedAlarms and PendingEvents are what EventQueue shares with the way out.
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

// Acknowledgements that wait for the disk: the client is told when they are saved, or why they are
// not. PendingEvents keeps them.
struct WaitingAck {
  std::size_t alarms = 0;
  WallTime at{};
  std::function<void(const Acknowledged&)> done;
};

/// To be called without a lock. `trouble`: why they are not on the disk; empty: they are.
void AnswerAcks(const std::vector<WaitingAck>& acks, const std::string& trouble);

// Which alarms the configuration still watches, and with which priority: one that nobody watches
// would be active for ever.

/// Empty: it can be neither raised nor ended any more.
std::optional<config::AlarmPriority> PriorityOf(const config::Config& config, const Alarm& alarm);

/// The priority of an alarm in the configuration; empty: the configuration no longer has it.
/// Without a function all alarms stay as they are.
using Watched = std::function<std::optional<config::AlarmPriority>(const Alarm&)>;

/// Brings alarms into line with the configuration. No lock: PendingEvents has it.
class WatchedAlarms {
 public:
  explicit WatchedAlarms(Watched watched) : watched_(std::move(watched)) {}

  /// A reload.
  void Renew(Watched watched) {
    watched_ = std::move(watched);
    due_ = true;
  }
  /// Follow is to be called, behind what was told up to now.
  bool due() const { return due_; }
  bool TakeDue() { return std::exchange(due_, false); }
  void SetDue() { due_ = true; }

  /// Ends what nobody watches any more, and changes priorities: by events into the book.
  void Follow(EventBook& book, WallTime at) const;

 private:
  Watched watched_;
  bool due_ = false;
};

struct LogOptions {
  std::filesystem::path file;  ///< empty: there is no place for it
  std::string why_no_file{};
  /// There is no file: events are known until the program ends.
  bool in_memory = false;
  std::string vfs{};  ///< as in Database
  /// Shared with the audit. Null: EventLog makes one.
  std::shared_ptr<records::EventsWriter> writer{};
  SourceNames sources;
  std::function<Now()> clocks;
  std::shared_ptr<EventFeed> feed{};  ///< gets what is on the disk; null: there is none
  /// The positions of consumers, kept in the file. Null: there are none.
  std::shared_ptr<CursorBook> cursors{};
  bool tells_own = false;  ///< the gateway's own events are kept, too
  Watched watches{};
  /// The last batches of these sources are on the disk, so the sources may be asked for more.
  /// Called on the writing thread.
  std::function<void(const std::vector<Source>& sources)> kept;
  /// The events of these records are on the disk, and the records are still to be read. Called on
  /// the writing thread: when the file first opens, and after a commit, before `kept`. Empty:
  /// records are not read.
  std::function<void(const std::vector<OwedRecord>& owed)> owed{};
  /// An alarm has changed, or was `raised`. Each change is reported once, also while the disk
  /// fails. Called on the writing thread, or from Watch. Empty: not wanted.
  std::function<void(const Alarm& alarm, bool raised)> alarm{};
  /// One line when the disk begins to fail, and one when it is well again; from any thread.
  std::function<void(const std::string&)> warn;
  std::function<void(const std::string&)> inform;
};

// The events that wait for the disk, the clients that wait for these events, and the condition of
// the disk. Shared by EventQueue, the way in, and EventRounds in
// gateway/records/events/event_log.h, the way out: both hold the mutex whenever they use it.
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
  records::DiskCondition disk BAUDGATE_GUARDED_BY(mutex);
  std::int64_t oldest BAUDGATE_GUARDED_BY(mutex) = 0;  ///< number of the first event in the file
  std::function<void()> on_opened BAUDGATE_GUARDED_BY(mutex);  ///< see EventQueue::WhenOpened
};

class EventQueue {
 public:
  /// `options` and `pending` outlive it.
  EventQueue(const LogOptions& options, PendingEvents& pending)
      : options_(options), pending_(pending) {}

  /// A batch of a device, with its names.
  void Add(Batch batch);
  /// An event of the gateway itself. It is left out if there are too many of its kind; see Shares.
  void Tell(EventRecord record);
  /// The values of a record are written in one commit. A record that is already in the file is not
  /// written again.
  void Keep(KeptRecord record);
  /// The gateway has started. This event comes before all others, and says how the previous run
  /// ended. Without a start, the run has no event for its end.
  void Started(const std::string& version);
  /// Adds the event for the end of this run; a second call adds none.
  void TellEnd();
  /// As TellEnd, for outputs that are to see this event: returns when it is on the disk, when the
  /// disk is in trouble, or after `most`.
  void End(Duration most);
  /// See EventSource.
  std::size_t Acknowledge(const AckQuery& query, std::function<void(const Acknowledged&)> done);
  /// Calls `opened` once when the file is open: at once, or on the writing thread.
  void WhenOpened(std::function<void()> opened);
  bool opened() const;
  /// A reload: gives all sources their new numbers. What is known of a source, also by a commit
  /// that is under way, stays with its names. Alarms that `watches` does not know end.
  void Renumber(SourceNames sources, Watched watches);

  /// The text (see EventBatch) of the source's last batch in the file. Valid once the file is open.
  std::string said(Source source) const;
  EventsState state() const;
  /// See PendingEvents.
  std::vector<Alarm> Alarms() const;

 private:
  const LogOptions& options_;
  PendingEvents& pending_;
};

}  // namespace baudgate::events
