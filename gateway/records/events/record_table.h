// The tables `records`, `record_values` and `owed_records` of events.db. Each call is part of the
// caller's transaction. One thread.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <vector>

#include "gateway/records/disk/database.h"
#include "gateway/records/events/kept_record.h"

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

}  // namespace baudgate::events
