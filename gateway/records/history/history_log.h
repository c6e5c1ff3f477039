// The history while the gateway runs. One thread looks at what has changed in the point store and
// decides what is kept; another writes it, once a second. Lines wait for neither. While the disk is
// slow, full or failing, entries wait in a queue that has an end; beyond it they are dropped and
// counted, and the history has a gap.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "gateway/base/guarded.h"
#include "gateway/base/worker.h"
#include "gateway/records/disk/disk_condition.h"
#include "gateway/records/history/batch_queue.h"
#include "gateway/records/history/change_recorder.h"
#include "gateway/records/history/history_view.h"
#include "gateway/records/history/value_store.h"

namespace baudgate::history {

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
    PointStore* store = nullptr;   ///< before the lines start
    std::filesystem::path folder;  ///< empty: there is no place for it
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
  void SetDisk(Disk disk, const std::string& trouble) BAUDGATE_REQUIRES(mutex_);

  const Options options_;
  const std::shared_ptr<HistoryView> view_;
  ChangeRecorder recorder_;  // used by the recording thread
  // Used by the writing thread.
  ValueStore files_;
  Instant look_at_{};
  std::optional<Instant> waits_since_;  // for another log
  Mutex mutex_;
  BatchQueue queue_ BAUDGATE_GUARDED_BY(mutex_);
  DiskCondition disk_ BAUDGATE_GUARDED_BY(mutex_);
  bool begin_anew_ BAUDGATE_GUARDED_BY(mutex_) = false;  // values are lost that were kept
  std::optional<Instant> writing_since_ BAUDGATE_GUARDED_BY(mutex_);
  Worker writing_;
  Worker recording_;
};

}  // namespace baudgate::history
