// The history while the gateway runs. One thread looks at what has changed in the point store and
// decides what is kept; another writes it, once a second. Lines wait for neither. While the disk is
// slow, full or failing, entries wait in a queue that has an end; beyond it they are dropped and
// counted, and the history has a gap. ValueStore decides which value goes to which file.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "gateway/base/guarded.h"
#include "gateway/base/result.h"
#include "gateway/base/worker.h"
#include "gateway/records/disk/disk.h"
#include "gateway/records/history/batch.h"
#include "gateway/records/history/folder_files.h"
#include "gateway/records/history/history_files.h"
#include "gateway/records/history/history_view.h"
#include "gateway/records/history/recorder.h"

namespace baudgate::history {

// Writes values to the files: decides which value goes to which file, when rows become chunks, and
// which files have to go. On one thread, without a clock.
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

class HistoryLog {
 public:
  /// Values are on the disk after this time at the latest; a power cut loses at most these.
  static constexpr Duration kCommit = 1s;
  /// What changes within it is looked at together.
  static constexpr Duration kLook = 20ms;
  /// What readers have found is looked at again.
  static constexpr Duration kLookAgain = 10s;
  /// A disk that takes longer does not answer in time.
  static constexpr Duration kLongestWrite = 3s;

  struct Options {
    const config::Config* config = nullptr;
    bus::PointStore* store = nullptr;  ///< before the lines start
    std::filesystem::path folder;      ///< empty: there is no place for it
    std::string why_no_folder{};
    /// The folder is there, and ours; asked before its files are opened. Empty: it is.
    std::function<Status()> ready{};
    /// Another log still ends, and has the files. Empty: there is none.
    std::function<bool()> taken{};
    std::string vfs{};  ///< as in Database
    std::function<Now()> clocks;
    /// One line when the disk begins to fail, and one when it is well again; from any thread.
    std::function<void(const std::string&)> warn;
    std::function<void(const std::string&)> inform;
  };
  explicit HistoryLog(Options options);
  /// Writes what is left; as long as the disk takes.
  ~HistoryLog();

  /// It may outlive this.
  std::shared_ptr<const HistorySource> view() const { return view_; }

 private:
  Instant Record(bool last);
  void HandOver(Batch&& batch) BAUDGATE_REQUIRES(mutex_);
  void WriteOnce(bool last);
  bool AreTaken(Instant now);
  void ShowFiles() BAUDGATE_REQUIRES(mutex_);
  void SetDisk(records::Disk disk, const std::string& trouble) BAUDGATE_REQUIRES(mutex_);

  const Options options_;
  const std::shared_ptr<HistoryView> view_;
  ChangeRecorder recorder_;  // used by the recording thread
  // Used by the writing thread.
  ValueStore files_;
  Instant look_at_{};
  std::optional<Instant> waits_since_;  // for another log
  Mutex mutex_;
  BatchQueue queue_ BAUDGATE_GUARDED_BY(mutex_);
  records::DiskCondition disk_ BAUDGATE_GUARDED_BY(mutex_);
  bool begin_anew_ BAUDGATE_GUARDED_BY(mutex_) = false;  // values are lost that were kept
  std::optional<Instant> writing_since_ BAUDGATE_GUARDED_BY(mutex_);
  Worker writing_;
  Worker recording_;
};

}  // namespace baudgate::history
