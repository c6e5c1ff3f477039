// What others may ask of the history: gateway/outputs/status and gateway/outputs/control. From any
// thread.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "gateway/records/disk/disk.h"
#include "gateway/records/history/history_page.h"
#include "gateway/records/history/recorder.h"

namespace baudgate::history {

struct HistoryState {
  Disk disk = Disk::opening;
  std::string trouble;               ///< why it fails; empty: it does not
  WallTime since{};                  ///< of `disk`
  std::size_t points = 0;            ///< whose values are kept
  RecorderCounters counters{};       ///< since the start
  std::uint64_t trends_dropped = 0;  ///< spans, since the start
  std::size_t waiting = 0;           ///< entries that are not on the disk yet
  std::uint64_t bytes = 0;           ///< of all files, when they were last looked at
  std::uint64_t limit = 0;
  WallTime oldest{};  ///< begin of the oldest day that is kept; the epoch: none is
  std::string folder;
  std::vector<std::string> put_aside{};  ///< damaged files that are still there, by name
  std::vector<std::string> unread{};     ///< files that nobody can read, or not whole, and why
};

class HistorySource {
 public:
  virtual ~HistorySource() = default;
  virtual HistoryState state() const = 0;
  /// Nothing while the files are being opened.
  virtual Result<Page> Read(const PageQuery& query) const = 0;
  virtual Result<TrendPage> ReadTrends(const TrendQuery& query) const = 0;
};

}  // namespace baudgate::history
