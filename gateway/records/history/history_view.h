// The history as outputs see it: its health and its values. A read that hangs in a disk keeps the
// view alive, also after a reload that has ended the log.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <functional>
#include <set>
#include <string>

#include "gateway/base/guarded.h"
#include "gateway/records/history/history_source.h"
#include "gateway/records/history/unread_files.h"

namespace baudgate::history {

class HistoryView final : public HistorySource {
 public:
  struct Options {
    std::filesystem::path folder{};  ///< empty: there is no place for it
    std::string why_no_folder{};
    /// One line for the log; from any thread.
    std::function<void(const std::string&)> warn{};
    std::function<void(const std::string&)> inform{};
  };
  explicit HistoryView(Options options) : options_(std::move(options)) {}

  HistoryState state() const override;
  Result<Page> Read(const PageQuery& query) const override;
  Result<TrendPage> ReadTrends(const TrendQuery& query) const override;

  // ---- for the log, which writes
  template <typename Change>
  void Update(Change change) {
    const MutexLock lock(mutex_);
    change(state_);
  }
  /// Files in which readers have found damage since the last call, by name.
  std::set<std::string> TakeDoubts();
  /// From time to time: what could not be read is read again. As long as the disk takes.
  void LookAgain();

 private:
  void Note(const UnreadFile& file, const PageQuery& query) const;

  const Options options_;
  mutable Mutex mutex_;
  HistoryState state_ BAUDGATE_GUARDED_BY(mutex_);
  mutable UnreadFiles unread_ BAUDGATE_GUARDED_BY(mutex_);
  mutable std::set<std::string> doubts_ BAUDGATE_GUARDED_BY(mutex_);
};

}  // namespace baudgate::history
