// The tables `past` and `past_points` of events.db: values that devices have measured and kept
// themselves, such as the load profiles of meters. Each value is a row with a number of its own and
// the device's time, which may be days ago. Each call is part of the caller's transaction. One
// thread; gateway/records/events/past_page.h reads from another connection.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

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

}  // namespace baudgate::events
