// `FolderFiles` lists the files of a history folder with their sizes, and `FindTooMuch` returns the
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
    std::uint64_t bytes = 0;  ///< with its write-ahead log
  };
  struct Aside {
    std::string name;
    std::uint64_t bytes = 0;                    ///< with its write-ahead log
    std::filesystem::file_time_type written{};  ///< time of the last write
  };
  std::vector<Day> days;     ///< oldest first
  std::vector<Aside> aside;  ///< damaged files that were renamed, oldest first
  std::uint64_t trends = 0;  ///< bytes of trends.db, with its write-ahead log
  std::uint64_t bytes() const;
};

/// Returns an empty list if the folder cannot be read.
FolderFiles ListFiles(const std::filesystem::path& folder);

/// Returns the size above which files are deleted. It is below `limit`, because sizes are checked
/// once a second and a commit may be large.
constexpr std::uint64_t Ceiling(std::uint64_t limit) {
  constexpr std::uint64_t kCommit = 10'000'000;
  return limit - std::max(limit / 100, std::min(limit / 10, kCommit));
}

struct TooMuch {
  std::string file;
  std::optional<Millis> day{};  ///< empty: a file that was put aside
  bool old = false;             ///< true: older than `keep`; false: exceeds the size limit
};

/// Returns the files to delete, in this order: first days that ended longer than `keep` before
/// `sure`; then, while the size exceeds the limit, files that were put aside, then days. The oldest
/// come first. Today's file and later files are never deleted. `sure` empty: no file is too old.
std::vector<TooMuch> FindTooMuch(FolderFiles folder_files, std::uint64_t limit, Millis keep,
                                 Millis today, std::optional<Millis> sure);

/// Returns a text with the two largest files: "values-20261123.db has 40.0 MB, trends.db 3.1 MB".
std::string Largest(const FolderFiles& folder_files);

/// Removes a database file with its write-ahead log. Failures are ignored.
void RemoveFile(const std::filesystem::path& folder, const std::string& file);

// `SureTime` returns the time that is used to judge the age of files. The clock of a machine may be
// wrong by years for a few seconds, or from the start on; files that were deleted because of a
// wrong clock are lost.
//
//   start, newest file of 20 Nov, clock shows 2099   → for a day nothing; then 21 Nov + uptime
//   clock set by more than a minute                  → for a day nothing
class SureTime {
 public:
  /// The clock is trusted after it has run for this time without being set.
  static constexpr Duration kSettled = kDay * 1ms;
  /// The clock was set if, between two calls of Look, it differs from the elapsed time by more than
  /// this.
  static constexpr Duration kStep = 1min;

  /// `newest`: begin of the newest day that has a file; empty: no file.
  void Begin(Now now, std::optional<Millis> newest);
  /// Returns a time that is not after `now`; empty: the clock cannot be trusted yet. To be called
  /// every second or so.
  std::optional<Millis> Look(Now now);

 private:
  Instant began_;
  Millis latest_ = 0;  // latest possible time at Begin
  Now last_{};
  Instant settles_;
};

// `Estimate` contains how many bytes a configuration will store, for `baudgate check`.
struct Estimate {
  std::uint64_t least = 0;    ///< bytes a day if no value changes
  std::uint64_t most = 0;     ///< bytes a day if every reading differs from the last
  std::uint64_t minutes = 0;  ///< bytes of trends.db with minutes for all of kKeepMinutes

  /// Returns after how many days the limit is reached.
  std::uint64_t Days(std::uint64_t limit, std::uint64_t bytes_a_day) const;
};

/// Uses the measured sizes of docs/performance.md.
Estimate EstimateOf(const config::Config& config);

}  // namespace baudgate::history
