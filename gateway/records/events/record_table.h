// The tables `records`, `record_values` and `owed_records` of events.db. Each call is part of the
// caller's transaction. One thread. ReadRecords reads kept records.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "gateway/base/result.h"
#include "gateway/records/disk/database.h"
#include "gateway/records/events/event_record.h"

namespace baudgate::events {

class RecordTable {
 public:
  /// The most of a kind that are kept; records of events are kept as long as their events.
  static constexpr std::int64_t kMost = 1'000'000;

  /// `database` is of OpenEvents, and outlives it.
  explicit RecordTable(Database& database, std::int64_t most = kMost);

  /// Writes it with the next number of its kind; its event owes it no longer. If a record with the
  /// same kind, line, device, name, device_time and event is there already, that one stays.
  bool Insert(const KeptRecord& record);
  bool Owe(const OwedRecord& owed);
  /// Deletes what belongs to events up to this number.
  bool Drop(std::int64_t event);

  bool ReadOwed(std::vector<OwedRecord>& owed);

 private:
  bool InsertValues(const KeptRecord& record, std::int64_t seq);

  Database& database_;
  const std::int64_t most_;
  Statement find_;
  Statement insert_;
  Statement value_;
  Statement owe_;
  Statement settle_;
  Statement drop_values_;
  Statement drop_;
  Statement drop_old_values_;
  Statement drop_old_;
  Statement drop_owed_;
};

// Reads kept records. The file may contain anything; every field is checked.
struct RecordQuery {
  std::string kind{};
  std::int64_t after = 0;           ///< a number of that kind
  std::string line{};               ///< empty: of all
  std::string device{};             ///< its bare name; empty: of all
  std::string name{};               ///< empty: of all
  std::optional<WallTime> since{};  ///< only records with this device_time or later
  std::optional<WallTime> until{};  ///< only records with an earlier device_time
};

struct RecordPage {
  std::vector<KeptRecord> records;  ///< by their numbers, each with all its values
  std::int64_t next = 0;            ///< `after` of the next page
  bool more = false;                ///< there were more at that time
};

/// A page ends after this many records, or after the record that brings it to this many values.
inline constexpr std::size_t kRecordPage = 100;
inline constexpr std::size_t kPageValues = 1000;

Result<RecordPage> ReadRecords(Database& database, const RecordQuery& query);
/// See ReadOnce.
Result<RecordPage> ReadRecords(const std::filesystem::path& file, const RecordQuery& query);

/// The records of events `first` to `last`, in order of their events.
Result<std::vector<KeptRecord>> ReadRecordsOf(Database& database, std::int64_t first,
                                              std::int64_t last);

}  // namespace baudgate::events
