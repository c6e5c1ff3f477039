// Writes values to the files: decides which value goes to which file, when rows become chunks, and
// which files have to go. On one thread (gateway/records/history/history_log.h), without a clock.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "gateway/base/result.h"
#include "gateway/records/history/folder_files.h"
#include "gateway/records/history/history_files.h"
#include "gateway/records/history/pending_values.h"
#include "gateway/records/history/store_limits.h"
#include "gateway/records/history/sure_time.h"

namespace baudgate::history {

class ValueStore {
 public:
  /// `vfs`: as in Database; with one nothing is listed or removed.
  ValueStore(std::filesystem::path folder, std::vector<PointName> names, StoreLimits limits,
             std::string vfs = {});
  ValueStore(const ValueStore&) = delete;
  ValueStore& operator=(const ValueStore&) = delete;

  /// Opens what is needed now. Before the first batch, and again after a failure.
  Status Open(Now clocks);
  /// Takes the batch, and writes it as far as it goes. What is left waits for the next call.
  /// `last`: nothing comes after it.
  Status Write(Batch&& batch, Now clocks, bool last = false);
  /// Readers have found damage in these: those that are open are read as a whole.
  void Check(const std::set<std::string>& files) { files_.Check(files); }
  /// The rest of an earlier batch waits.
  bool waits() const {
    return !pending_.batch().samples.empty() || !pending_.batch().trends.empty();
  }

  std::size_t waiting() const { return pending_.batch().samples.size(); }

  /// Since the last call: files that were put aside, removed by somebody else, or deleted.
  std::vector<News> TakeNews() { return std::exchange(news_, {}); }
  /// Since the last call values of the run that goes on were lost with their file. What came after
  /// them is of another run, in which points that did not change are unknown.
  bool TakeLost() { return pending_.TakeLost(); }
  const FolderFiles& folder_files() const { return folder_files_; }

 private:
  void CutLostRun();
  Status WriteDays(Millis now, bool last);
  Status WriteTrends(Millis now);
  Status Clear(Millis now);
  std::string WhyItGoes(const TooMuch& file) const;

  const std::filesystem::path folder_;
  const StoreLimits limits_;
  const bool lists_;
  std::vector<News> news_;
  HistoryFiles files_;
  PendingValues pending_;
  Millis marked_ = 0;  // when runs were last written to today's file
  Millis looked_ = 0;  // at the folder
  SureTime sure_time_;
  std::optional<Millis> sure_;
  FolderFiles folder_files_;
};

}  // namespace baudgate::history
