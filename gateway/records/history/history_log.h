// `HistoryLog` stores the history while the gateway runs. One thread reads the changes of the point
// store and decides which values are stored; another thread writes them once a second. Lines wait
// for neither. While the disk is slow, full or failing, entries wait in a queue of limited size.
// When the queue is full, entries are dropped and counted, and the history has a gap.
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

// `ValueStore` writes values to the files. It decides to which file a value goes, when rows become
// chunks, and which files are deleted. Used by one thread; it reads no clock.
class ValueStore {
 public:
  /// `vfs`: as in Database. If it is not empty, files are neither listed nor deleted.
  ValueStore(std::filesystem::path folder, std::vector<PointName> names, StoreLimits limits,
             std::string vfs = {});
  ValueStore(const ValueStore&) = delete;
  ValueStore& operator=(const ValueStore&) = delete;

  /// Opens the files that are needed now. To be called before the first batch, and again after a
  /// failure.
  Status Open(Now clocks);
  /// Adds the batch to the values that wait, and writes as many of them as possible. Values that
  /// cannot be written wait for the next call. `last`: this is the last call.
  Status Write(Batch&& batch, Now clocks, bool last = false);
  void Check(const std::set<std::string>& files) { files_.Check(files); }
  bool waits() const {
    return !pending_.batch().samples.empty() || !pending_.batch().trends.empty();
  }

  std::size_t waiting() const { return pending_.batch().samples.size(); }

  /// Returns the messages since the last call, about files that were put aside, removed by another
  /// program, or deleted.
  std::vector<News> TakeNews() { return std::exchange(news_, {}); }
  /// True if a file with values of the present run was lost since the last call. Later values
  /// belong to a new run, in which a point is unknown until it changes.
  bool TakeLost() { return pending_.TakeLost(); }
  const FolderFiles& folder_files() const { return folder_files_; }

 private:
  bool CutLostRun();
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
  Millis looked_ = 0;
  SureTime sure_time_;
  std::optional<Millis> sure_;
  FolderFiles folder_files_;
};

class HistoryLog {
 public:
  /// The interval of commits. A power cut loses the values since the last commit.
  static constexpr Duration kCommit = 1s;
  /// Changes that come within this time are read together.
  static constexpr Duration kLook = 20ms;
  /// The interval at which files that could not be read are tried again.
  static constexpr Duration kLookAgain = 10s;
  /// A write that takes longer than this counts as a stalled disk.
  static constexpr Duration kLongestWrite = 3s;

  struct Options {
    const config::Config* config = nullptr;
    bus::PointStore* store = nullptr;  ///< the lines must not have started yet
    std::filesystem::path folder;      ///< empty: there is no folder; see `why_no_folder`
    std::string why_no_folder{};
    /// Checks that the folder exists and belongs to the gateway; called before files are opened.
    /// Empty: no check.
    std::function<Status()> ready{};
    /// Returns true while the HistoryLog before a reload still writes the files. Empty: there was
    /// none.
    std::function<bool()> taken{};
    std::string vfs{};
    std::function<Now()> clocks;
    /// These receive one line for the log, on any thread: `warn` for example when the disk begins
    /// to fail, `inform` when the disk works again.
    std::function<void(const std::string&)> warn;
    std::function<void(const std::string&)> inform;
  };
  explicit HistoryLog(Options options);
  /// Writes all values that wait, however long the disk takes; warns if values are lost.
  ~HistoryLog();

  /// The values and state of this history. The view can be used after this object is destroyed.
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
  ChangeRecorder recorder_;
  // Only the writing thread uses files_, look_at_ and waits_since_.
  ValueStore files_;
  Instant look_at_{};
  std::optional<Instant> waits_since_;  // since when this log waits for an earlier log to end
  Mutex mutex_;
  BatchQueue queue_ BAUDGATE_GUARDED_BY(mutex_);
  records::DiskCondition disk_ BAUDGATE_GUARDED_BY(mutex_);
  // True: stored values of the present run are lost, so the recorder must begin a new run.
  bool begin_anew_ BAUDGATE_GUARDED_BY(mutex_) = false;
  std::optional<Instant> writing_since_ BAUDGATE_GUARDED_BY(mutex_);
  Worker writing_;
  Worker recording_;
};

}  // namespace baudgate::history
