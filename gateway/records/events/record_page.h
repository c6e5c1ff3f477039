// Reads kept records. The file may contain anything; every field is checked.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "gateway/base/result.h"
#include "gateway/records/disk/database.h"
#include "gateway/records/events/kept_record.h"

namespace baudgate::events {

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
