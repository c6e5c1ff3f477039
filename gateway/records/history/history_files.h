// The files of the history that are open, and the damage that was found while they were: a damaged
// file is closed, and put aside when it is opened next. TrendFile is trends.db, with the minutes
// and hours of each point.
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
  /// Rows of a day's file that become chunks before the hour is over.
  std::size_t open_rows = 1'500'000;
  std::size_t pack_each = 40'000;  ///< entries that are packed at a time
};

// trends.db: minutes and hours of each point. docs/history.md has the tables.

/// "BGtr".
inline constexpr std::int64_t kTrendsApplication = 0x42477472;
inline constexpr const char* kTrendsFile = "trends.db";

/// Minutes older than this go, 60 for each hour that comes; and hours.
inline constexpr Millis kKeepMinutes = 14 * kDay;
inline constexpr Millis kKeepHours = 3660 * kDay;

class TrendFile final : public PointFile {
 public:
  /// `names` outlives it.
  TrendFile(std::filesystem::path path, const std::vector<PointName>& names, std::string vfs = {})
      : PointFile(std::move(path), names, std::move(vfs)) {}

  /// `damage`: was found while it was in use.
  Opened Open(const std::string& damage = {});
  /// All or none. The same once more changes nothing. `sure`: see SureTime; spans are too old for
  /// it, and for those that come.
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

/// One line for the log.
struct News {
  std::string text;
  bool trouble = true;
};

class HistoryFiles {
 public:
  /// `vfs`: as in Database. `news` outlives this, and gets files that were put aside, or that
  /// somebody else has removed.
  HistoryFiles(std::filesystem::path folder, std::vector<PointName> names, std::string vfs,
               std::vector<News>& news);

  /// Does nothing if it is open.
  Status OpenTrends();
  /// Opens the files of these days and keeps that of `today` open. Returns the last run that they
  /// know.
  Result<std::int64_t> OpenDays(const std::vector<Millis>& days, Millis today);
  /// Opens the file if it is not open; see TakeLost.
  Result<DayFile*> Day(Millis day);
  /// Why the last call of this file failed. It is closed if it is damaged.
  Error Failed(DayFile& file);
  /// While they are open. `sure`: see SureTime.
  Status WriteTrends(const std::vector<TrendRow>& trends, const std::vector<Run>& runs,
                     std::optional<Millis> sure);
  /// The latest run in trends.db.
  std::int64_t last_run() const { return last_run_; }

  /// Whether they are still there, and whole.
  void Look();
  /// Readers have found damage in these: those that are open are read as a whole.
  void Check(const std::set<std::string>& files);
  /// Since the last call values of the run that goes on were lost with their file.
  bool TakeLost() { return std::exchange(lost_, false); }

  /// A step: rows of past hours become chunks, and files of past days are closed.
  Status Pack(Millis now, const StoreLimits& limits);
  void CloseDay(Millis day) { days_.erase(day); }

 private:
  void NoteOpened(const std::string& put_aside, const std::optional<std::string>& lost);
  bool NoteLook(const records::OpenFile::Look& look, const std::filesystem::path& path);

  const std::filesystem::path folder_;
  const std::vector<PointName> names_;
  const std::string vfs_;
  std::vector<News>& news_;
  std::map<Millis, std::unique_ptr<DayFile>> days_;  // that are open
  std::unique_ptr<TrendFile> trends_;
  std::map<Millis, std::string> damaged_days_;
  std::string damaged_trends_;  // empty: nothing was found
  std::int64_t last_run_ = 0;
  bool lost_ = false;
};

}  // namespace baudgate::history
