// The tables `records`, `record_values` and `owed_records` of events.db. Each call is part of the
// caller's transaction. One thread. ReadRecords reads kept records. PastTable has the
// values that devices have measured and kept themselves.
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
  /// The most of a kind that are kept; records of events are kept as long as their events.
  static constexpr std::int64_t kMost = 1'000'000;

  /// `database` is of OpenEvents, and outlives it.
  explicit RecordTable(records::Database& database, std::int64_t most = kMost);

  /// Writes it with the next number of its kind; its event owes it no longer. If a record with the
  /// same kind, line, device, name, device_time and event is there already, that one stays.
  bool Insert(const KeptRecord& record);
  bool Owe(const OwedRecord& owed);
  /// Deletes what belongs to events up to this number.
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

Result<RecordPage> ReadRecords(records::Database& database, const RecordQuery& query);
/// See ReadOnce.
Result<RecordPage> ReadRecords(const std::filesystem::path& file, const RecordQuery& query);

/// The records of events `first` to `last`, in order of their events.
Result<std::vector<KeptRecord>> ReadRecordsOf(records::Database& database, std::int64_t first,
                                              std::int64_t last);

// The tables `past` and `past_points` of events.db: values that devices have measured and kept
// themselves, such as the load profiles of meters. Each value is a row with a number of its own and
// the device's time, which may be days ago. Each call is part of the caller's transaction. One
// thread; ReadPast reads from another connection. PastTable writes the rows.

class PastTable {
 public:
  /// The most values that are kept: about 270 MB, 70 years of one meter by half hours.
  static constexpr std::int64_t kMost = 5'000'000;

  /// `database` is of OpenEvents, and outlives it.
  explicit PastTable(records::Database& database, std::int64_t most = kMost);

  /// A record without values is a gap in all values of its series.
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

// Reads values that devices have measured themselves, page by page, for `baudgate history`: over a
// connection of its own, so nothing waits for it. The file may contain anything.

/// Where a page ended: times of a device may come twice, numbers do not.
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

/// A span of time that begins at `time`. Without a quality its value is lost.
struct PastRow {
  WallTime time{};
  Duration span{};
  Value value{};
  std::optional<Quality> quality{};
};

struct PastPage {
  std::vector<PastRow> rows{};  ///< by their times
  PastCursor next{};
  bool more = false;
  bool known = false;  ///< there is a series of that name
};

Result<PastPage> ReadPast(records::Database& database, const PastQuery& query);
/// See ReadOnce.
Result<PastPage> ReadPast(const std::filesystem::path& file, const PastQuery& query,
                          bool* damaged = nullptr);

}  // namespace baudgate::events
