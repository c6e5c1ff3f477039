// `HistoryView` is the history for outputs: its state and its values. A read that hangs on a slow
// disk holds a reference to the view, so the view can outlive a log that a reload has ended.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <functional>
#include <limits>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "gateway/base/guarded.h"
#include "gateway/base/result.h"
#include "gateway/records/disk/disk.h"
#include "gateway/records/history/batch.h"
#include "gateway/records/history/recorder.h"

namespace baudgate::history {

// `ReadPage` reads the history page by page, for `baudgate history`. It uses separate connections,
// so no writer waits for it. The files can contain anything, so every field is checked.
// `UnreadFiles` lists files that could not be read.

/// The limit of records in one page: about 100 kB on the control socket.
inline constexpr std::size_t kPage = 1000;

struct Gap {
  Millis until = 0;
  RunBegin why = RunBegin::started;
};

struct HistoryRecord {
  Entry entry{};  ///< for a gap, only `time` is set: the beginning of the gap
  std::optional<Gap> gap{};
};

/// The position at which a page ended: after `time` in the run `run`.
struct Cursor {
  std::int64_t run = 0;
  Millis time = std::numeric_limits<Millis>::min();
};

struct PageQuery {
  std::string point{};  ///< LINE.DEVICE.POINT
  Millis since = 0;     ///< returns only records at this time or later
  Millis until = std::numeric_limits<Millis>::max();  ///< returns only records before this time
  Cursor after{};
};

struct UnreadFile {
  Millis day = 0;
  std::string text{};  ///< name and reason: "values-20261123.db: file is not a database"
  bool damaged = false;

  bool operator==(const UnreadFile&) const = default;
};

struct Page {
  /// Sorted by run, and within a run by time. This is the order of recording, even if the clock was
  /// set back.
  std::vector<HistoryRecord> records{};
  Cursor next{};
  bool more = false;
  bool known = false;
  std::vector<UnreadFile> unread{};
};

Result<Page> ReadPage(const std::filesystem::path& folder, const PageQuery& query);

struct TrendQuery {
  std::string point{};
  Millis since = 0;
  Millis until = std::numeric_limits<Millis>::max();
  Millis every = kHour;  ///< width of a span; whole minutes
};

struct TrendPage {
  std::vector<Trend> spans{};  ///< sorted by time, without regard to runs
  Millis next = 0;
  bool more = false;
  bool known = false;
};

/// Reads trends of one point. The last span can be incomplete: it ends with the last full minute.
/// `damaged`: see ReadOnce.
Result<TrendPage> ReadTrends(const std::filesystem::path& folder, const TrendQuery& query,
                             bool* damaged = nullptr);

// `UnreadFiles` lists files of days that could not be read completely. Each file is read again from
// time to time, and removed from the list when reading works: the file was repaired or removed, or
// file descriptors are available again. No lock: HistoryView provides it.
class UnreadFiles {
 public:
  static constexpr std::size_t kMost = 16;

  struct Entry {
    UnreadFile file{};
    PageQuery query{};
  };
  /// Adds a file. Returns true if the file is not in the list yet. Files beyond kMost are ignored.
  bool Note(const UnreadFile& file, const PageQuery& query);
  void Forget(const UnreadFile& file);
  const std::vector<Entry>& entries() const { return entries_; }

  static bool CanBeRead(const std::filesystem::path& folder, const Entry& entry);

 private:
  std::vector<Entry> entries_;
};

// `HistoryState` and `HistorySource` are the interface to the history for gateway/outputs/status
// and gateway/outputs/control. Thread-safe.
struct HistoryState {
  records::Disk disk = records::Disk::opening;
  std::string trouble;
  WallTime since{};
  std::size_t points = 0;
  RecorderCounters counters{};       ///< since the start
  std::uint64_t trends_dropped = 0;  ///< trends that were dropped since the start
  std::size_t waiting = 0;
  std::uint64_t bytes = 0;  ///< size of all files when they were last listed
  std::uint64_t limit = 0;
  WallTime oldest{};  ///< beginning of the oldest stored day; the epoch: no day is stored
  std::string folder;
  std::vector<std::string> put_aside{};
  std::vector<std::string> unread{};
};

class HistorySource {
 public:
  virtual ~HistorySource() = default;
  virtual HistoryState state() const = 0;
  /// Returns no records while the files are being opened.
  virtual Result<Page> Read(const PageQuery& query) const = 0;
  virtual Result<TrendPage> ReadTrends(const TrendQuery& query) const = 0;
};

class HistoryView final : public HistorySource {
 public:
  struct Options {
    std::filesystem::path folder{};  ///< empty: there is no folder; see `why_no_folder`
    std::string why_no_folder{};
    /// These receive one line for the log, on any thread.
    std::function<void(const std::string&)> warn{};
    std::function<void(const std::string&)> inform{};
  };
  explicit HistoryView(Options options) : options_(std::move(options)) {}

  HistoryState state() const override;
  Result<Page> Read(const PageQuery& query) const override;
  Result<TrendPage> ReadTrends(const TrendQuery& query) const override;

  // The functions below are for HistoryLog only.
  template <typename Change>
  void Update(Change change) {
    const MutexLock lock(mutex_);
    change(state_);
  }
  /// Returns the names of files in which readers have found damage since the last call.
  std::set<std::string> TakeDoubts();
  /// Reads the files again that could not be read before, however long the disk takes. To be called
  /// from time to time.
  void LookAgain();

 private:
  void Note(const UnreadFile& file, const PageQuery& query) const;

  const Options options_;
  mutable Mutex mutex_;
  HistoryState state_ BAUDGATE_GUARDED_BY(mutex_);
  mutable UnreadFiles unread_ BAUDGATE_GUARDED_BY(mutex_);
  mutable std::set<std::string> doubts_ BAUDGATE_GUARDED_BY(mutex_);
};

// `ReadChart` reduces the history of a point to the values that a chart of `pixels` pixels can
// show: minimum, mean and maximum of each step. Short time ranges are computed from all stored
// values, long ranges from minutes and hours.

inline constexpr std::int64_t kMostPixels = 4096;

struct ChartQuery {
  std::string point{};  ///< LINE.DEVICE.POINT
  Millis since = 0;
  Millis until = 0;  ///< end, exclusive; must not be later than now
  std::int64_t pixels = 1200;
};

struct Chart {
  Millis step = 0;
  std::vector<Trend> rows{};  ///< sorted by time; a step without a good value has no row
  bool known = false;
};

Result<Chart> ReadChart(const HistorySource& source, const ChartQuery& query);

}  // namespace baudgate::history
