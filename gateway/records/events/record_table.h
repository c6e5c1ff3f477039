// `RecordTable` writes the tables `records`, `record_values` and `owed_records` (events whose
// records are still to be read) of events.db. Each call is part of the caller's transaction. Used
// by one thread.
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
  /// The limit of the stored records of one kind. It does not apply to records of events, which are
  /// deleted with their events.
  static constexpr std::int64_t kMost = 1'000'000;

  /// `database` must come from OpenEvents, and outlive this object.
  explicit RecordTable(records::Database& database, std::int64_t most = kMost);

  /// Writes a record with the next number of its kind, and removes its event from `owed_records`.
  /// If the file already contains a record with the same kind, line, device, name, device_time and
  /// event, the record is not written again.
  bool Insert(const KeptRecord& record);
  bool Owe(const OwedRecord& owed);
  /// Deletes the records of events up to this event number.
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

// RecordQuery selects stored records for ReadRecords, which checks every field of the file.
struct RecordQuery {
  std::string kind{};
  std::int64_t after = 0;
  std::string line{};
  std::string device{};             ///< name of the device without its line; empty: all devices
  std::string name{};               ///< empty: all names
  std::optional<WallTime> since{};  ///< returns only records with this device_time or later
  std::optional<WallTime> until{};  ///< returns only records with an earlier device_time
};

struct RecordPage {
  std::vector<KeptRecord> records;  ///< sorted by number, each with all its values
  std::int64_t next = 0;            ///< value of `after` for the next page
  bool more = false;
};

/// A page ends after kRecordPage records, or after the record with which the number of values
/// reaches kPageValues.
inline constexpr std::size_t kRecordPage = 100;
inline constexpr std::size_t kPageValues = 1000;

Result<RecordPage> ReadRecords(records::Database& database, const RecordQuery& query);
Result<RecordPage> ReadRecords(const std::filesystem::path& file, const RecordQuery& query);

Result<std::vector<KeptRecord>> ReadRecordsOf(records::Database& database, std::int64_t first,
                                              std::int64_t last);

// `PastTable` writes the tables `past` and `past_points` of events.db: values that devices have
// measured and stored themselves, such as the load profiles of meters. Each value is a numbered row
// with the device's time, which can be days ago. Each call is part of the caller's transaction.
// Used by one thread; `ReadPast` reads over another connection.

class PastTable {
 public:
  /// The limit of the number of stored values: about 270 MB, or 70 years of half-hour values of one
  /// meter.
  static constexpr std::int64_t kMost = 5'000'000;

  /// `database` must come from OpenEvents, and outlive this object.
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

// `ReadPast` reads values that devices have measured and stored themselves, page by page, for
// `baudgate history`. It uses a separate connection, so no writer waits for it. The file may be
// damaged, so a row can contain any value.

/// The position at which a page ended. A device can report a time twice, so the row number is
/// needed as well.
struct PastCursor {
  std::int64_t seq = 0;
  std::int64_t time = std::numeric_limits<std::int64_t>::min();  ///< microseconds since 1970
};

struct PastQuery {
  std::string line{};
  std::string device{};
  std::string name{};  ///< series and value: "load_1.active_import"
  std::optional<WallTime> since{};
  std::optional<WallTime> until{};
  PastCursor after{};
};

/// A value of the time span that begins at `time`. If `quality` is empty, the value is lost.
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
  bool known = false;  ///< true: the file contains a series of that name
};

Result<PastPage> ReadPast(records::Database& database, const PastQuery& query);
Result<PastPage> ReadPast(const std::filesystem::path& file, const PastQuery& query,
                          bool* damaged = nullptr);

}  // namespace baudgate::events
