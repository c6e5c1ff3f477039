// `FolderFiles` lists the files of a history folder with their sizes. `FindTooMuch` returns the
// files to delete.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "config/model/config.h"
#include "gateway/base/time.h"
#include "gateway/records/history/batch.h"

namespace baudgate::history {

struct FolderFiles {
  struct Day {
    Millis day = 0;
    std::uint64_t bytes = 0;                    ///< size, with the write-ahead log
    std::filesystem::file_time_type written{};  ///< when the file or its log was last changed
  };
  struct Aside {
    std::string name;
    std::uint64_t bytes = 0;
    std::filesystem::file_time_type written{};
  };
  std::vector<Day> days;     ///< oldest first
  std::vector<Aside> aside;  ///< damaged files that were renamed, oldest first
  std::uint64_t trends = 0;  ///< size of trends.db in bytes, with its write-ahead log
  std::uint64_t bytes() const;
};

/// Returns empty lists if the folder cannot be read.
FolderFiles ListFiles(const std::filesystem::path& folder);

/// Returns the size above which files are deleted. It is below `limit`, because sizes are checked
/// at most once a second, and one commit can be large.
constexpr std::uint64_t Ceiling(std::uint64_t limit) {
  constexpr std::uint64_t kCommit = 10'000'000;
  return limit - std::max(limit / 100, std::min(limit / 10, kCommit));
}

struct TooMuch {
  std::string file;
  std::optional<Millis> day{};  ///< the day of the file; empty: a file that was put aside
  bool old = false;  ///< true: the file is older than `keep`; false: the size limit is exceeded
};

/// Returns the files to delete: first days that ended longer than `keep` before `sure`; then, while
/// the size exceeds the limit, files that were put aside, then days. The oldest files of each kind
/// come first. Today's file and later files are never deleted. `sure` empty: no file is too old.
std::vector<TooMuch> FindTooMuch(FolderFiles folder_files, std::uint64_t limit, Millis keep,
                                 Millis today, std::optional<Millis> sure);

/// Returns a text with the two largest files. Example: "values-20261123.db has 40.0 MB, trends.db
/// 3.1 MB".
std::string Largest(const FolderFiles& folder_files);

/// Removes a database file with its write-ahead log. Failures are ignored.
void RemoveFile(const std::filesystem::path& folder, const std::string& file);

// `SureTime` returns the time by which the age of files is judged. The clock of a machine can be
// wrong by years for a few seconds, or from the start on, and must not cause files to be deleted.
//
//   start, newest file of 20 Nov, clock shows 2099   → for a day nothing; then 21 Nov + uptime
//   clock set by more than a minute                  → for a day nothing
class SureTime {
 public:
  /// The clock is trusted after it has run for this time without being set.
  static constexpr Duration kSettled = kDay * 1ms;
  /// The clock counts as set if it and the monotonic clock differ by more than this in the time
  /// between two calls of Look.
  static constexpr Duration kStep = 1min;

  /// `newest`: the beginning of the newest day that has a file; empty: there is no file.
  void Begin(Now now, std::optional<Millis> newest);
  /// Returns the time by which the age of files is judged, not later than `now`; empty: the clock
  /// cannot be trusted yet. To be called about every second.
  std::optional<Millis> Look(Now now);

 private:
  Instant began_;
  Millis latest_ = 0;  // the end of the newest stored day, or the clock at Begin
  Now last_{};
  Instant settles_;
};

// `Estimate` tells how many bytes a configuration will store, for `baudgate check`.
struct Estimate {
  std::uint64_t least = 0;    ///< bytes a day if no value changes
  std::uint64_t most = 0;     ///< bytes a day if every reading differs from the previous one
  std::uint64_t minutes = 0;  ///< bytes of trends.db when it contains minutes for kKeepMinutes

  std::uint64_t Days(std::uint64_t limit, std::uint64_t bytes_a_day) const;
};

/// Estimates from the sizes that were measured in docs/performance.md.
Estimate EstimateOf(const config::Config& config);

}  // namespace baudgate::history
