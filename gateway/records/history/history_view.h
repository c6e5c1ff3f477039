// The history as outputs see it: its health and its values. A read that hangs in a disk keeps the
// view alive, also after a reload that has ended the log. HistorySource is the interface for
// outputs, ReadPage reads a page of records, and ReadChart reduces a history to what a chart can
// show.
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

// Reads the history back, page by page: for `baudgate history`, over connections of its own that
// hold up nothing. The files may contain anything; every field is checked. UnreadFiles names files
// that could not be read.

/// Records of one page: about 100 kB of the control socket.
inline constexpr std::size_t kPage = 1000;

/// Between two runs.
struct Gap {
  Millis until = 0;
  RunBegin why = RunBegin::started;
};

struct HistoryRecord {
  Entry entry{};             ///< of a gap: only its time
  std::optional<Gap> gap{};  ///< from then on nothing is known of the point
};

/// Where a page has ended: after this time of this run.
struct Cursor {
  std::int64_t run = 0;
  Millis time = std::numeric_limits<Millis>::min();
};

struct PageQuery {
  std::string point{};                                ///< LINE.DEVICE.POINT
  Millis since = 0;                                   ///< none before
  Millis until = std::numeric_limits<Millis>::max();  ///< none then or later
  Cursor after{};
};

/// A file that could not be read, or not whole: what it holds is missing in a page.
struct UnreadFile {
  Millis day = 0;
  std::string text{};    ///< "values-20261123.db: file is not a database"
  bool damaged = false;  ///< SQLite says so

  bool operator==(const UnreadFile&) const = default;
};

struct Page {
  /// By runs and in them by time: as it was, whatever the clock.
  std::vector<HistoryRecord> records{};
  Cursor next{};
  bool more = false;
  bool known = false;  ///< some file has the point
  std::vector<UnreadFile> unread{};
};

Result<Page> ReadPage(const std::filesystem::path& folder, const PageQuery& query);

struct TrendQuery {
  std::string point{};
  Millis since = 0;
  Millis until = std::numeric_limits<Millis>::max();
  Millis every = kHour;  ///< whole minutes
};

struct TrendPage {
  std::vector<Trend> spans{};  ///< by time; of all runs together
  Millis next = 0;             ///< `since` of the next page
  bool more = false;
  bool known = false;
};

/// The last span is as far as it has come, to the last minute that is over. `damaged`: see
/// ReadOnce.
Result<TrendPage> ReadTrends(const std::filesystem::path& folder, const TrendQuery& query,
                             bool* damaged = nullptr);

// Files of days that could not be read, or not whole. Each is read again from time to time,
// and forgotten when that works: the file was mended or removed, or there are descriptors again.
// No lock: HistoryView has it.
class UnreadFiles {
 public:
  static constexpr std::size_t kMost = 16;

  struct Entry {
    UnreadFile file{};
    PageQuery query{};  ///< of this day alone
  };
  /// Whether it is new. Beyond the most it is passed over.
  bool Note(const UnreadFile& file, const PageQuery& query);
  void Forget(const UnreadFile& file);
  const std::vector<Entry>& entries() const { return entries_; }

  /// Reads it once more.
  static bool CanBeRead(const std::filesystem::path& folder, const Entry& entry);

 private:
  std::vector<Entry> entries_;
};

// What others may ask of the history: gateway/outputs/status and gateway/outputs/control. From any
// thread.
struct HistoryState {
  records::Disk disk = records::Disk::opening;
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

// The history of a point reduced to what a chart of so many pixels can show: minimum, mean and
// maximum of each step. Short times from every kept value, long ones from minutes and hours.

inline constexpr std::int64_t kMostPixels = 4096;

struct ChartQuery {
  std::string point{};  ///< LINE.DEVICE.POINT
  Millis since = 0;
  Millis until = 0;  ///< not in it any more; at most now
  std::int64_t pixels = 1200;
};

struct Chart {
  Millis step = 0;
  std::vector<Trend> rows{};  ///< by time; of steps without a good value none
  bool known = false;         ///< some file has the point
};

Result<Chart> ReadChart(const HistorySource& source, const ChartQuery& query);

}  // namespace baudgate::history
