// `RecordTable` writes the tables `records`, `record_values` and `owed_records` of events.db. Each
// call is part of the caller's transaction. Used by one thread.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <limits>
#include <optional>
#include <string>
#include <vector>

#include "gateway/base/result.h"
#include "gateway/base/time.h"
#include "gateway/base/value.h"
#include "gateway/records/disk/database.h"
#include "gateway/records/events/event_record.h"
#include "protocols/conversation.h"

namespace baudgate::events {

class RecordTable {
 public:
  /// Limit of the stored records of one kind. Records of events are deleted with their events
  /// instead.
  static constexpr std::int64_t kMost = 1'000'000;

  /// `database`: as OpenEvents has opened it; must outlive this object.
  explicit RecordTable(records::Database& database, std::int64_t most = kMost);

  /// Writes a record with the next number of its kind, and removes its event from `owed_records`.
  /// If the file already contains a record with the same kind, line, device, name, device_time and
  /// event, that record stays.
  bool Insert(const KeptRecord& record);
  bool Owe(const OwedRecord& owed);
  /// Deletes the records of events up to this number.
  bool Drop(std::int64_t event);

  bool ReadOwed(std::vector<OwedRecord>& owed);

 private:
  bool InsertValues(const KeptRecord& record, std::int64_t seq);

  records::Database& database_;
  const std::int64_t most_;
  records::Statement find_;
  records::Statement insert_;
  records::Statement value_;
  records::Statement owe_;
  records::Statement settle_;
  records::Statement drop_values_;
  records::Statement drop_;
  records::Statement drop_old_values_;
  records::Statement drop_old_;
  records::Statement drop_owed_;
};

// Selects stored records for ReadRecords. The file may contain anything, so every field is checked.
struct RecordQuery {
  std::string kind{};
  std::int64_t after = 0;           ///< only records of that kind with a greater number
  std::string line{};               ///< empty: all
  std::string device{};             ///< bare name of the device; empty: all
  std::string name{};               ///< empty: all
  std::optional<WallTime> since{};  ///< only records with this device_time or later
  std::optional<WallTime> until{};  ///< only records with an earlier device_time
};

struct RecordPage {
  std::vector<KeptRecord> records;  ///< sorted by number, each with all its values
  std::int64_t next = 0;            ///< `after` of the next page
  bool more = false;                ///< the file contained more records at that time
};

/// A page ends after this many records, or after the record that brings it to this many values.
inline constexpr std::size_t kRecordPage = 100;
inline constexpr std::size_t kPageValues = 1000;

Result<RecordPage> ReadRecords(records::Database& database, const RecordQuery& query);
/// See ReadOnce.
Result<RecordPage> ReadRecords(const std::filesystem::path& file, const RecordQuery& query);

/// Returns the records of events `first` to `last`, sorted by event.
Result<std::vector<KeptRecord>> ReadRecordsOf(records::Database& database, std::int64_t first,
                                              std::int64_t last);

// `PastTable` writes the tables `past` and `past_points` of events.db: values that devices have
// measured and stored themselves, such as the load profiles of meters. Each value is a numbered row
// with the device's time, which may be days ago. Each call is part of the caller's transaction.
// Used by one thread; `ReadPast` reads over another connection.

class PastTable {
 public:
  /// Limit of the stored values: about 270 MB, 70 years of one meter by half hours.
  static constexpr std::int64_t kMost = 5'000'000;

  /// `database`: as OpenEvents has opened it; must outlive this object.
  explicit PastTable(records::Database& database, std::int64_t most = kMost);

  /// Writes the values of a device. A record without values is written as a gap in all points of
  /// its series.
  bool Insert(const std::string& line, const std::string& device,
              const std::vector<protocols::PastRecord>& records);

 private:
  std::optional<std::int64_t> PointOf(const std::string& line, const std::string& device,
                                      const std::string& name);
  bool InsertRow(std::int64_t point, const protocols::PastRecord& record,
                 const protocols::PastValue* value);
  bool InsertGap(const std::string& line, const std::string& device,
                 const protocols::PastRecord& record);

  const std::int64_t most_;
  records::Statement add_point_;
  records::Statement find_point_;
  records::Statement of_series_;
  records::Statement insert_;
  records::Statement drop_;
};

// `ReadPast` reads values that devices have measured themselves, page by page, for `baudgate
// history`. It uses a separate connection, so nothing waits for it. The file may contain anything.

/// The position at which a page ended. A device may report a time twice, so the row number is
/// needed as well.
struct PastCursor {
  std::int64_t seq = 0;
  std::int64_t time = std::numeric_limits<std::int64_t>::min();  ///< microseconds since 1970
};

struct PastQuery {
  std::string line{};
  std::string device{};
  std::string name{};  ///< "load_1.active_import"
  std::optional<WallTime> since{};
  std::optional<WallTime> until{};
  PastCursor after{};
};

/// A value of the time span that begins at `time`. Without a quality, the value is lost.
struct PastRow {
  WallTime time{};
  Duration span{};
  Value value{};
  std::optional<Quality> quality{};
};

struct PastPage {
  std::vector<PastRow> rows{};  ///< sorted by time
  PastCursor next{};
  bool more = false;
  bool known = false;  ///< the file contains a series of that name
};

Result<PastPage> ReadPast(records::Database& database, const PastQuery& query);
/// See ReadOnce.
Result<PastPage> ReadPast(const std::filesystem::path& file, const PastQuery& query,
                          bool* damaged = nullptr);

}  // namespace baudgate::events
