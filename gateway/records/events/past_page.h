// Reads values that devices have measured themselves, page by page, for `baudgate history`: over a
// connection of its own, so nothing waits for it. The file may contain anything.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <limits>
#include <optional>
#include <string>
#include <vector>

#include "gateway/base/quality.h"
#include "gateway/base/result.h"
#include "gateway/base/time.h"
#include "gateway/base/value.h"
#include "gateway/records/disk/database.h"

namespace baudgate::events {

/// Rows of one page: about 100 kB of the control socket.
inline constexpr std::size_t kPastPage = 1000;

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
