// trends.db: minutes and hours of each point. docs/history.md has the tables.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "gateway/records/disk/database_file.h"
#include "gateway/records/disk/open_file.h"
#include "gateway/records/history/batch.h"

namespace baudgate::history {

/// "BGtr".
inline constexpr std::int64_t kTrendsApplication = 0x42477472;
inline constexpr const char* kTrendsFile = "trends.db";

/// Minutes older than this go, 60 for each hour that comes; and hours.
inline constexpr Millis kKeepMinutes = 14 * kDay;
inline constexpr Millis kKeepHours = 3660 * kDay;

/// One thread. After a call that failed error() has words.
class TrendFile {
 public:
  /// `names` outlives it.
  TrendFile(std::filesystem::path path, const std::vector<PointName>& names, std::string vfs = {});

  struct Opened {
    bool ok = false;
    std::string put_aside{};
    std::optional<std::string> lost{};
    std::int64_t last_run = 0;
  };
  /// `damage`: was found while it was in use.
  Opened Open(const std::string& damage = {});
  /// All or none. The same once more changes nothing. `sure`: see SureTime; spans are too old for
  /// it, and for those that come.
  bool Write(const std::vector<TrendRow>& trends, const std::vector<Run>& runs,
             std::optional<Millis> sure);

  const std::string& error() const { return error_; }
  bool damaged() const { return damaged_; }
  OpenFile::Look LookAt() { return open_.LookAt(*database_); }
  /// What a reader has found is looked for: all of it is read.
  std::optional<std::string> Damage() { return database_->Damage(); }
  const std::filesystem::path& path() const { return path_; }

 private:
  bool Fail();
  bool ReadPoints();
  bool MendHours();
  bool MendHours(std::int64_t point, const Run& run);
  bool Insert(const TrendRow& row, std::optional<Millis> sure);
  static bool InsertSpan(Statement& insert, std::int64_t point, std::int64_t run,
                         const Trend& trend);
  std::int64_t IdOf(PointNumber point);

  const std::filesystem::path path_;
  const std::vector<PointName>& names_;
  const std::string vfs_;
  std::unique_ptr<Database> database_;
  OpenFile open_;
  Statement minute_;
  Statement hour_;
  Statement drop_minutes_;
  Statement drop_hours_;
  Statement run_;
  std::vector<std::int64_t> ids_;  // by point; 0: it has none yet
  bool damaged_ = false;
  std::string error_;
};

}  // namespace baudgate::history
