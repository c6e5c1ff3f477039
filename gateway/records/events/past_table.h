// The tables `past` and `past_points` of events.db: values that devices have measured and kept
// themselves, such as the load profiles of meters. Each value is a row with a number of its own and
// the device's time, which may be days ago. Each call is part of the caller's transaction. One
// thread; ReadPast reads from another connection. PastTable writes the rows.
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
#include "protocols/conversation.h"

namespace baudgate::events {

class PastTable {
 public:
  /// The most values that are kept: about 270 MB, 70 years of one meter by half hours.
  static constexpr std::int64_t kMost = 5'000'000;

  /// `database` is of OpenEvents, and outlives it.
  explicit PastTable(Database& database, std::int64_t most = kMost);

  /// A record without values is a gap in all values of its series.
  bool Insert(const std::string& line, const std::string& device,
              const std::vector<PastRecord>& records);

 private:
  std::optional<std::int64_t> PointOf(const std::string& line, const std::string& device,
                                      const std::string& name);
  bool InsertRow(std::int64_t point, const PastRecord& record, const PastValue* value);
  bool InsertGap(const std::string& line, const std::string& device, const PastRecord& record);

  const std::int64_t most_;
  Statement add_point_;
  Statement find_point_;
  Statement of_series_;
  Statement insert_;
  Statement drop_;
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

Result<PastPage> ReadPast(Database& database, const PastQuery& query);
/// See ReadOnce.
Result<PastPage> ReadPast(const std::filesystem::path& file, const PastQuery& query,
                          bool* damaged = nullptr);

}  // namespace baudgate::events
