// The files of a history folder as a whole: how large they are, and which of them have to go.
// SureTime says by which time files are too old, and EstimateOf how many bytes a configuration will
// keep.
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
    std::uint64_t bytes = 0;  ///< with its log
  };
  struct Aside {
    std::string name;
    std::uint64_t bytes = 0;                    ///< with its log
    std::filesystem::file_time_type written{};  ///< last
  };
  std::vector<Day> days;     ///< oldest first
  std::vector<Aside> aside;  ///< files that were put aside, oldest first
  std::uint64_t trends = 0;  ///< bytes of trends.db, with its log
  std::uint64_t bytes() const;
};

/// Empty if the folder cannot be read.
FolderFiles ListFiles(const std::filesystem::path& folder);

/// The limit itself is not reached: it is looked once a second, and a commit may be large.
constexpr std::uint64_t Ceiling(std::uint64_t limit) {
  constexpr std::uint64_t kCommit = 10'000'000;
  return limit - std::max(limit / 100, std::min(limit / 10, kCommit));
}

struct TooMuch {
  std::string file;
  std::optional<Millis> day{};  ///< empty: it was put aside
  bool old = false;             ///< true: past `keep`; false: too much for the size limit
};

/// Files that go, in that order: days that ended longer than `keep` before `sure`, then for the
/// limit files that were put aside, then days; oldest first. Never today's, and none that came
/// after it. `sure`: nothing: none is too old.
std::vector<TooMuch> FindTooMuch(FolderFiles folder_files, std::uint64_t limit, Millis keep,
                                 Millis today, std::optional<Millis> sure);

/// "values-20261123.db has 40.0 MB, trends.db 3.1 MB": the two largest.
std::string Largest(const FolderFiles& folder_files);

/// A file with all that belongs to it.
void RemoveFile(const std::filesystem::path& folder, const std::string& file);

// By which time files are judged too old. The clock of a machine may be wrong by years for a few
// seconds, or from the start on; what is deleted by it does not come back when it is set.
//
//   start, newest file of 20 Nov, clock says 2099    → for a day nothing; then 21 Nov + uptime
//   clock set by more than a minute                  → for a day nothing
class SureTime {
 public:
  /// A clock must have gone on so long, by itself.
  static constexpr Duration kSettled = kDay * 1ms;
  /// One that goes faster or slower than this between two looks was set. Less is no harm.
  static constexpr Duration kStep = 1min;

  /// `newest`: begin of the newest day of which there are files; empty: there are none.
  void Begin(Now now, std::optional<Millis> newest);
  /// Often. Empty: the clock is not to be trusted yet; else it is not after `now`.
  std::optional<Millis> Look(Now now);

 private:
  Instant began_;
  Millis latest_ = 0;  // that it could have been when it began
  Now last_{};
  Instant settles_;
};

// How many bytes a configuration will keep, before it runs: for `baudgate check`.
struct Estimate {
  std::uint64_t least = 0;    ///< bytes a day when nothing changes
  std::uint64_t most = 0;     ///< bytes a day when every reading is another one
  std::uint64_t minutes = 0;  ///< bytes of trends.db, once it has all minutes that it keeps

  /// Until the limit is reached, with so many bytes a day.
  std::uint64_t Days(std::uint64_t limit, std::uint64_t bytes_a_day) const;
};

/// By what was measured (docs/performance.md).
Estimate EstimateOf(const config::Config& config);

}  // namespace baudgate::history
