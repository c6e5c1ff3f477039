// `HistoryLog` stores the history while the gateway runs. One thread reads the changes of the point
// store and decides which values are stored; another thread writes them once a second. Lines wait
// for neither. While the disk is slow, full or failing, entries wait in a bounded queue. When it is
// full, entries are dropped and counted, and the history has a gap.
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

// `ValueStore` writes values to the files. It decides which value goes to which file, when rows
// become chunks, and which files are deleted. Used by one thread; it reads no clock.
class ValueStore {
 public:
  /// `vfs`: as in Database; if it is not empty, files are neither listed nor deleted.
  ValueStore(std::filesystem::path folder, std::vector<PointName> names, StoreLimits limits,
             std::string vfs = {});
  ValueStore(const ValueStore&) = delete;
  ValueStore& operator=(const ValueStore&) = delete;

  /// Opens the files that are needed now. Call this before the first batch, and again after a
  /// failure.
  Status Open(Now clocks);
  /// Takes over the batch, and writes as much of it as possible. The rest waits for the next call.
  /// `last`: this is the last call.
  Status Write(Batch&& batch, Now clocks, bool last = false);
  /// See HistoryFiles::Check.
  void Check(const std::set<std::string>& files) { files_.Check(files); }
  bool waits() const {
    return !pending_.batch().samples.empty() || !pending_.batch().trends.empty();
  }

  std::size_t waiting() const { return pending_.batch().samples.size(); }

  /// Returns messages about files that were put aside, removed by another program, or deleted.
  std::vector<News> TakeNews() { return std::exchange(news_, {}); }
  /// See HistoryFiles::TakeLost. Later values belong to another run, in which points are unknown
  /// until they change.
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
  Millis marked_ = 0;  // when the runs were last written to today's file
  Millis looked_ = 0;  // when the folder was last listed
  SureTime sure_time_;
  std::optional<Millis> sure_;
  FolderFiles folder_files_;
};

class HistoryLog {
 public:
  /// Interval of commits: a power cut loses at most the values of this time.
  static constexpr Duration kCommit = 1s;
  /// Changes within this time are read together.
  static constexpr Duration kLook = 20ms;
  /// Interval at which files that could not be read are checked again.
  static constexpr Duration kLookAgain = 10s;
  /// A write that takes longer counts as a stalled disk.
  static constexpr Duration kLongestWrite = 3s;

  struct Options {
    const config::Config* config = nullptr;
    bus::PointStore* store = nullptr;  ///< point store; the lines must not have started yet
    std::filesystem::path folder;      ///< empty: no folder; see `why_no_folder`
    std::string why_no_folder{};
    /// Checks that the folder exists and belongs to the gateway; called before its files are
    /// opened. Empty: no check.
    std::function<Status()> ready{};
    /// Returns true while an earlier log still writes to the files. Empty: no earlier log.
    std::function<bool()> taken{};
    std::string vfs{};  ///< as in Database
    std::function<Now()> clocks;
    /// Called from any thread: `warn` when the disk begins to fail, `inform` when the disk works
    /// again.
    std::function<void(const std::string&)> warn;
    std::function<void(const std::string&)> inform;
  };
  explicit HistoryLog(Options options);
  /// Writes all values that wait, so it blocks for as long as the disk takes.
  ~HistoryLog();

  /// Returns the view, which may outlive this object.
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
  std::optional<Instant> waits_since_;  // waiting for another log to end
  Mutex mutex_;
  BatchQueue queue_ BAUDGATE_GUARDED_BY(mutex_);
  records::DiskCondition disk_ BAUDGATE_GUARDED_BY(mutex_);
  bool begin_anew_ BAUDGATE_GUARDED_BY(mutex_) = false;  // stored values of the run are lost
  std::optional<Instant> writing_since_ BAUDGATE_GUARDED_BY(mutex_);
  Worker writing_;
  Worker recording_;
};

}  // namespace baudgate::history
