// `EventFile` is the events' part of events.db: it opens the file when needed, writes batches, and
// reports failures. Used by one thread (gateway/records/events/event_log.h); it reads no clock.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "gateway/base/result.h"
#include "gateway/records/disk/database.h"
#include "gateway/records/disk/events_file.h"
#include "gateway/records/events/alarm.h"
#include "gateway/records/events/event_book.h"
#include "gateway/records/events/event_feed.h"
#include "gateway/records/events/own_records.h"
#include "gateway/records/events/record_table.h"

namespace baudgate::events {

// `AlarmTable` is the table `alarms` of events.db, with the alarms that are not normal. An alarm is
// written in the transaction of the event that has changed it. Used by one thread.
class AlarmTable {
 public:
  /// `database` must outlive this object.
  explicit AlarmTable(records::Database& database);

  bool Read(std::vector<Alarm>& alarms);
  /// Writes an alarm to the table, or removes it from the table if its state is normal.
  bool Write(const Alarm& alarm);

 private:
  records::Database& database_;
  records::Statement write_;
  records::Statement remove_;
};

// `EventTable` handles the tables `events` and `event_sources` of events.db: it writes batches in
// one transaction, and deletes the oldest events. Used by one thread;
// gateway/records/events/event_source.h reads over another connection.

/// The limit of the number of stored events: about 200 MB.
inline constexpr std::int64_t kMostEvents = 1'000'000;

class EventTable {
 public:
  /// `database` must come from OpenEvents, and outlive this object.
  explicit EventTable(records::Database& database, std::int64_t most = kMostEvents);

  struct Contents {
    bool ok = false;
    std::int64_t last = 0;
    Said said{};
    LastRun last_run{};
    std::vector<Alarm> alarms{};
    std::vector<OwedRecord> owed{};
    Cursors cursors{};
    FeedImage image{};
  };
  Contents Read(FeedLimits limits = {});
  /// Writes all or nothing: the events, the alarms that they have changed, the list of records that
  /// are still to be read, and `records`. `cursors` replace the cursors in the file; null: these do
  /// not change.
  bool Write(const std::vector<Batch>& batches, const Cursors* cursors = nullptr,
             const std::vector<KeptRecord>& records = {});
  bool WriteAlarms(const std::vector<Alarm>& alarms);
  Result<std::vector<EventRecord>> ReadBehind(std::int64_t after);
  /// Number of the oldest event; 0: the file contains no event.
  std::int64_t oldest() const { return oldest_; }

 private:
  bool ReadRun(Contents& contents);
  bool ReadCursors(Cursors& cursors);
  bool WriteCursors(const Cursors& cursors);
  bool Insert(const Batch& batch);
  bool InsertRecord(const EventRecord& event);
  bool Drop(std::int64_t newest);
  bool FindOldest();
  bool ReadImage(FeedLimits limits, FeedImage& image);

  records::Database& database_;
  const std::int64_t most_;
  std::int64_t oldest_ = 0;
  records::Statement insert_;
  records::Statement said_;
  records::Statement drop_;
  records::Statement cursor_;
  AlarmTable alarms_;
  RecordTable records_;
  PastTable past_;
};

class EventFile {
 public:
  explicit EventFile(std::filesystem::path path, std::string vfs = {},
                     std::shared_ptr<records::EventsWriter> writer = {});

  struct Opened : records::EventsConnection::Opened {
    EventTable::Contents contents{};
  };
  /// Opens and reads the file. Returns nothing if the file is already open.
  std::optional<Opened> Open();
  /// Writes as EventTable::Write does. The file must be open; if it is damaged, it is closed.
  Status Write(const std::vector<Batch>& batches, const Cursors* cursors = nullptr,
               const std::vector<KeptRecord>& records = {});
  /// Reads and checks the whole file, which must be open, because a reader has found damage.
  Status Check();
  std::vector<std::string> PutAside() const { return records::PutAsideOf(connection_.path()); }
  /// Returns a page of the events after number `after`. The file must be open.
  Result<std::vector<EventRecord>> ReadBehind(std::int64_t after);
  std::int64_t oldest() const { return table_ ? table_->oldest() : 0; }

  /// True if the file was opened again and can be a new file without alarms. WriteAlarms must then
  /// be called.
  bool lacks_alarms() const { return lacks_alarms_; }
  Status WriteAlarms(const std::vector<Alarm>& alarms);

  const std::filesystem::path& path() const { return connection_.path(); }

 private:
  records::EventsConnection connection_;
  std::optional<EventTable> table_;
  bool was_open_ = false;
  bool lacks_alarms_ = false;
};

}  // namespace baudgate::events
