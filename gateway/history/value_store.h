// The files of the history: which of them are open, what goes to which, when rows become chunks,
// and which have to go. On one thread (gateway/history/history_log.h), without a clock.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "config/model/history.h"
#include "gateway/base/result.h"
#include "gateway/history/day_file.h"
#include "gateway/history/folder_files.h"
#include "gateway/history/sure_time.h"
#include "gateway/history/trend_file.h"

namespace baudgate::history {

struct StoreLimits {
  std::uint64_t bytes = 1000 * config::kMegabyte;
  Millis keep = 365 * kDay;
  /// Rows of a day's file that become chunks before the hour is over.
  std::size_t open_rows = 1'500'000;
  std::size_t pack_each = 40'000;  ///< entries that are packed at a time
};

/// One line for the log.
struct News {
  std::string text;
  bool trouble = true;
};

class ValueStore {
 public:
  /// `vfs`: as in Database; with one nothing is listed or removed.
  ValueStore(std::filesystem::path folder, std::vector<PointName> names, StoreLimits limits,
             std::string vfs = {});

  /// Opens what is needed now. Before the first batch, and again after a failure.
  Status Open(Now clocks);
  /// Takes the batch, and writes it as far as it goes. What is left waits for the next call.
  /// `last`: nothing comes after it.
  Status Write(Batch&& batch, Now clocks, bool last = false);
  /// Readers have found damage in these: those that are open are read as a whole.
  void Check(const std::set<std::string>& files);
  /// The rest of an earlier batch waits.
  bool waits() const { return !pending_.samples.empty() || !pending_.trends.empty(); }

  std::size_t waiting() const { return pending_.samples.size(); }

  /// Since the last call: files that were put aside, removed behind our back, or deleted.
  std::vector<News> TakeNews() { return std::exchange(news_, {}); }
  /// Since the last call values of the run that goes on were lost with their file. What came after
  /// them is of another run, in which points that did not change are unknown.
  bool TakeLost() { return std::exchange(lost_, false); }
  const FolderFiles& folder_files() const { return folder_files_; }

 private:
  void NoteFile(const std::string& put_aside, const std::optional<std::string>& lost);
  Status OpenTrends();
  Result<DayFile*> FileOf(Millis day);
  void Number(Batch& batch) const;
  void LookAtFiles();
  bool NoteLook(const OpenFile::Look& look, const std::filesystem::path& path);
  void CutRun();
  Status WriteDays(Millis now, bool last);
  Status WriteTrends(Millis now);
  Status Pack(Millis now);
  Status Clear(Millis now);
  std::string WhyItGoes(const TooMuch& file) const;
  Error Failed(DayFile& file);

  const std::filesystem::path folder_;
  const std::vector<PointName> names_;
  const StoreLimits limits_;
  const std::string vfs_;
  std::map<Millis, std::unique_ptr<DayFile>> days_;  // that are open
  std::unique_ptr<TrendFile> trends_;
  // What was found while they were in use.
  std::map<Millis, std::string> damaged_days_;
  std::string damaged_trends_;               // empty: nothing
  std::optional<std::int64_t> runs_before_;  // of this start: the last number in the files
  Batch pending_;                            // with numbers of the files
  Millis marked_ = 0;                        // when runs were last written to today's file
  std::int64_t known_run_ = 0;               // to trends.db
  Millis looked_ = 0;                        // at the folder_files
  SureTime sure_time_;
  std::optional<Millis> sure_;
  bool lost_ = false;
  std::optional<Run> cut_;  // began in the middle of the recorder's
  FolderFiles folder_files_;
  std::vector<News> news_;
};

}  // namespace baudgate::history
