// The tables `events` and `event_sources` of events.db: batches in, in one transaction, and the
// oldest out. One thread; gateway/records/events/event_page.h reads from another connection.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <vector>

#include "gateway/base/result.h"
#include "gateway/records/disk/database.h"
#include "gateway/records/events/alarm_table.h"
#include "gateway/records/events/cursors.h"
#include "gateway/records/events/event_book.h"
#include "gateway/records/events/event_feed.h"
#include "gateway/records/events/own_records.h"
#include "gateway/records/events/past_table.h"
#include "gateway/records/events/record_table.h"

namespace baudgate::events {

/// The most events that are kept: about 200 MB.
inline constexpr std::int64_t kMostEvents = 1'000'000;

class EventTable {
 public:
  /// `database` is of OpenEvents, and outlives it.
  explicit EventTable(Database& database, std::int64_t most = kMostEvents);

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

  Database& database_;
  const std::int64_t most_;
  std::int64_t oldest_ = 0;
  Statement insert_;
  Statement said_;
  Statement drop_;
  Statement cursor_;
  AlarmTable alarms_;
  RecordTable records_;
  PastTable past_;
};

}  // namespace baudgate::events
