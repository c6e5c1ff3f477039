// Reads kept events, page by page, for `baudgate events`: over a connection of its own, so nothing
// waits for it. The file may contain anything; every field is checked.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "gateway/base/result.h"
#include "gateway/records/disk/database.h"
#include "gateway/records/events/event_record.h"

namespace baudgate::events {

/// Records of one page: about 40 kB of the control socket.
inline constexpr std::size_t kPage = 200;

struct PageQuery {
  std::int64_t after = 0;           ///< a number
  std::string line{};               ///< empty: of all
  std::string device{};             ///< its bare name; empty: of all
  std::optional<WallTime> since{};  ///< only events received at this time or later
};

struct Page {
  std::vector<EventRecord> records;  ///< by their numbers
  std::int64_t next = 0;             ///< `after` of the next page
  bool more = false;                 ///< there were more at that time
};

Result<Page> ReadPage(Database& database, const PageQuery& query);
/// See ReadOnce; with the records of the events. A page with many values is shorter.
Result<Page> ReadPage(const std::filesystem::path& file, const PageQuery& query,
                      bool* damaged = nullptr);

}  // namespace baudgate::events
