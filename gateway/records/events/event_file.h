// The events' part of events.db: opens the file when it is needed, writes what the book has due,
// and reports what went wrong. On one thread (gateway/records/events/event_log.h), without a
// clock. AlarmTable and EventTable handle the rows of their tables.
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

// The table `alarms` of events.db: alarms that are not normal. Written in the transaction of the
// event that has changed them. One thread.
class AlarmTable {
 public:
  /// `database` outlives it.
  explicit AlarmTable(records::Database& database);

  bool Read(std::vector<Alarm>& alarms);
  /// A normal one is removed.
  bool Write(const Alarm& alarm);

 private:
  records::Database& database_;
  records::Statement write_;
  records::Statement remove_;
};

// The tables `events` and `event_sources` of events.db: batches in, in one transaction, and the
// oldest out. One thread; gateway/records/events/event_source.h reads from another connection.

/// The most events that are kept: about 200 MB.
inline constexpr std::int64_t kMostEvents = 1'000'000;

class EventTable {
 public:
  /// `database` is of OpenEvents, and outlives it.
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
  /// Writes all or none: events, the alarms that they have changed, and the records that they owe.
  /// `cursors`: replace those in the file; null: they stay.
  bool Write(const std::vector<Batch>& batches, const Cursors* cursors = nullptr,
             const std::vector<KeptRecord>& records = {});
  /// Writes these alarms, and deletes all others.
  bool WriteAlarms(const std::vector<Alarm>& alarms);
  /// The next events after a number.
  Result<std::vector<EventRecord>> ReadBehind(std::int64_t after);
  /// The number of the oldest event; 0: there is none.
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
  /// As EventsConnection.
  explicit EventFile(std::filesystem::path path, std::string vfs = {},
                     std::shared_ptr<records::EventsWriter> writer = {});

  struct Opened : records::EventsConnection::Opened {
    EventTable::Contents contents{};
  };
  /// Empty: it was open already.
  std::optional<Opened> Open();
  /// Only if open. All of them are on the disk, or none is. See EventTable.
  Status Write(const std::vector<Batch>& batches, const Cursors* cursors = nullptr,
               const std::vector<KeptRecord>& records = {});
  /// Only if open. A reader has found damage: the whole file is checked.
  Status Check();
  /// See PutAsideOf.
  std::vector<std::string> PutAside() const { return records::PutAsideOf(connection_.path()); }
  /// Open.
  Result<std::vector<EventRecord>> ReadBehind(std::int64_t after);
  std::int64_t oldest() const { return table_ ? table_->oldest() : 0; }

  /// Whether it was opened again: the file may be a new one, without alarms.
  bool lacks_alarms() const { return lacks_alarms_; }
  /// Only if open. These alarms are on the disk, and no others.
  Status WriteAlarms(const std::vector<Alarm>& alarms);

  const std::filesystem::path& path() const { return connection_.path(); }

 private:
  records::EventsConnection connection_;
  std::optional<EventTable> table_;
  bool was_open_ = false;
  bool lacks_alarms_ = false;
};

}  // namespace baudgate::events
