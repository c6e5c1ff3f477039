// `HistoryFiles` manages the open files of the history. A damaged file is closed, and put aside
// (renamed) when the day is opened again.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "config/model/config.h"
#include "gateway/base/result.h"
#include "gateway/records/disk/database_file.h"
#include "gateway/records/history/batch.h"
#include "gateway/records/history/day_file.h"

namespace baudgate::history {

struct StoreLimits {
  std::uint64_t bytes = 1000 * config::kMegabyte;
  Millis keep = 365 * kDay;
  /// If a day's file has this many rows, they become chunks before their hour is over.
  std::size_t open_rows = 1'500'000;
  std::size_t pack_each = 40'000;  ///< how many entries one call of Pack packs
};

// `TrendFile` is trends.db: the means of each point over minutes and hours. docs/history.md
// describes the tables.

inline constexpr std::int64_t kTrendsApplication = 0x42477472;
inline constexpr const char* kTrendsFile = "trends.db";

/// Minutes and hours older than these limits are deleted when an hour of the same point is written.
inline constexpr Millis kKeepMinutes = 14 * kDay;
inline constexpr Millis kKeepHours = 3660 * kDay;

class TrendFile final : public PointFile {
 public:
  /// `names` must outlive this object.
  TrendFile(std::filesystem::path path, const std::vector<PointName>& names, std::string vfs = {})
      : PointFile(std::move(path), names, std::move(vfs)) {}

  /// `damage`: damage that was found while the file was in use; if not empty, the file is put
  /// aside.
  Opened Open(const std::string& damage = {});
  /// Writes all rows or none. Writing the same rows again changes nothing. `sure`: see SureTime;
  /// minutes and hours are deleted only if they are too old by `sure` and by the time of the new
  /// rows.
  bool Write(const std::vector<TrendRow>& trends, const std::vector<Run>& runs,
             std::optional<Millis> sure);

 private:
  bool MendHours();
  bool MendHours(std::int64_t point, const Run& run);
  bool Insert(const TrendRow& row, std::optional<Millis> sure);
  static bool InsertSpan(records::Statement& insert, std::int64_t point, std::int64_t run,
                         const Trend& trend);
  std::int64_t IdOf(PointNumber point);

  records::Statement minute_;
  records::Statement hour_;
  records::Statement drop_minutes_;
  records::Statement drop_hours_;
};

struct News {
  std::string text;
  bool trouble = true;
};

class HistoryFiles {
 public:
  /// `vfs`: as in Database. `news` must outlive this object; it receives messages about files that
  /// were put aside, or removed by another program.
  HistoryFiles(std::filesystem::path folder, std::vector<PointName> names, std::string vfs,
               std::vector<News>& news);

  Status OpenTrends();
  /// Opens the files of these days and returns the last run number in them. Only the file of
  /// `today` stays open.
  Result<std::int64_t> OpenDays(const std::vector<Millis>& days, Millis today);
  /// Returns the file of the day, and opens it if necessary. The pointer is valid until the day's
  /// file is closed.
  Result<DayFile*> Day(Millis day);
  /// Returns why the last call of `file` failed. Closes the file if it is damaged.
  Error Failed(DayFile& file);
  Status WriteTrends(const std::vector<TrendRow>& trends, const std::vector<Run>& runs,
                     std::optional<Millis> sure);
  std::int64_t last_run() const { return last_run_; }

  /// Closes open files that were removed, replaced or damaged.
  void Look();
  /// Checks the whole content of the open files among `files`, in which readers have found damage.
  void Check(const std::set<std::string>& files);
  bool TakeLost() { return std::exchange(lost_, false); }

  /// Performs one step of packing: rows of past hours become chunks, and files of past days are
  /// closed.
  Status Pack(Millis now, const StoreLimits& limits);
  void CloseDay(Millis day) { days_.erase(day); }

 private:
  void NoteOpened(const std::string& put_aside, const std::optional<std::string>& lost);
  bool NoteLook(const records::OpenFile::Look& look, const std::filesystem::path& path);

  const std::filesystem::path folder_;
  const std::vector<PointName> names_;
  const std::string vfs_;
  std::vector<News>& news_;
  std::map<Millis, std::unique_ptr<DayFile>> days_;
  std::unique_ptr<TrendFile> trends_;
  std::map<Millis, std::string> damaged_days_;
  std::string damaged_trends_;
  std::int64_t last_run_ = 0;
  bool lost_ = false;
};

}  // namespace baudgate::history
