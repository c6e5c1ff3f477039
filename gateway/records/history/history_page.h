// Reads the history back, page by page: for `baudgate history`, over connections of its own that
// hold up nothing. The files may contain anything; every field is checked. UnreadFiles names files
// that could not be read.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <limits>
#include <optional>
#include <string>
#include <vector>

#include "gateway/base/result.h"
#include "gateway/records/history/batch.h"

namespace baudgate::history {

/// Records of one page: about 100 kB of the control socket.
inline constexpr std::size_t kPage = 1000;

/// Between two runs.
struct Gap {
  Millis until = 0;
  RunBegin why = RunBegin::started;
};

struct HistoryRecord {
  Entry entry{};             ///< of a gap: only its time
  std::optional<Gap> gap{};  ///< from then on nothing is known of the point
};

/// Where a page has ended: after this time of this run.
struct Cursor {
  std::int64_t run = 0;
  Millis time = std::numeric_limits<Millis>::min();
};

struct PageQuery {
  std::string point{};                                ///< LINE.DEVICE.POINT
  Millis since = 0;                                   ///< none before
  Millis until = std::numeric_limits<Millis>::max();  ///< none then or later
  Cursor after{};
};

/// A file that could not be read, or not whole: what it holds is missing in a page.
struct UnreadFile {
  Millis day = 0;
  std::string text{};    ///< "values-20261123.db: file is not a database"
  bool damaged = false;  ///< SQLite says so

  bool operator==(const UnreadFile&) const = default;
};

struct Page {
  /// By runs and in them by time: as it was, whatever the clock.
  std::vector<HistoryRecord> records{};
  Cursor next{};
  bool more = false;
  bool known = false;  ///< some file has the point
  std::vector<UnreadFile> unread{};
};

Result<Page> ReadPage(const std::filesystem::path& folder, const PageQuery& query);

struct TrendQuery {
  std::string point{};
  Millis since = 0;
  Millis until = std::numeric_limits<Millis>::max();
  Millis every = kHour;  ///< whole minutes
};

struct TrendPage {
  std::vector<Trend> spans{};  ///< by time; of all runs together
  Millis next = 0;             ///< `since` of the next page
  bool more = false;
  bool known = false;
};

/// The last span is as far as it has come, to the last minute that is over. `damaged`: see
/// ReadOnce.
Result<TrendPage> ReadTrends(const std::filesystem::path& folder, const TrendQuery& query,
                             bool* damaged = nullptr);

// Files of days that could not be read, or not whole. Each is read again from time to time,
// and forgotten when that works: the file was mended or removed, or there are descriptors again.
// No lock: gateway/records/history/history_view.h has it.
class UnreadFiles {
 public:
  static constexpr std::size_t kMost = 16;

  struct Entry {
    UnreadFile file{};
    PageQuery query{};  ///< of this day alone
  };
  /// Whether it is new. Beyond the most it is passed over.
  bool Note(const UnreadFile& file, const PageQuery& query);
  void Forget(const UnreadFile& file);
  const std::vector<Entry>& entries() const { return entries_; }

  /// Reads it once more.
  static bool CanBeRead(const std::filesystem::path& folder, const Entry& entry);

 private:
  std::vector<Entry> entries_;
};

}  // namespace baudgate::history
