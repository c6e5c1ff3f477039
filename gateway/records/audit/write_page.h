// Reads the records of the audit, page by page, for `baudgate writes`: over a connection of its
// own, so nothing waits for it. The file may contain anything; every field is checked.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "gateway/base/result.h"
#include "gateway/records/audit/write_record.h"
#include "gateway/records/disk/database.h"

namespace baudgate::audit {

/// Records of one page: a line of the control socket of about 40 kB, 1 MB at most.
inline constexpr std::size_t kPage = 100;

struct PageQuery {
  /// seq: all records, in the order of the requests. settled: those that have ended, in the order
  /// of their ends; a record never appears before one that was read already.
  enum class Order : std::uint8_t { seq, settled } order = Order::seq;
  std::int64_t after = 0;         ///< a number in that order
  std::optional<WallTime> since;  ///< only writes requested at this time or later
};

struct Page {
  std::vector<WriteRecord> records;
  std::int64_t next = 0;  ///< `after` of the next page
  bool more = false;      ///< there were more at that time
};

Result<Page> ReadPage(Database& database, const PageQuery& query);
/// The latest writes to points of each client that numbers its requests, the latest first. `now`:
/// for their age.
Result<std::vector<PastRequest>> ReadRequests(Database& database, WallTime now);
/// See ReadOnce.
Result<Page> ReadPage(const std::filesystem::path& file, const PageQuery& query,
                      bool* damaged = nullptr);

}  // namespace baudgate::audit
