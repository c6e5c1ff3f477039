// `KeptReader` reads the stored values of all points, so that an output can forward them and go on
// after a restart. The order is run by run, in each run span by span, and in each span point by
// point.
//
//   run 7   10:00      11:00                     each span: all values of bay.f1.a,
//           |---- span ----|-- span --|…          then all of bay.f1.b, …
//
// The values of one point come in the order of their times. Files can be written, packed and
// deleted meanwhile. A span contains only times for which all values are in the files: of the last
// run up to Recorder::kSettle before its end, because the recorder stores no earlier times any more
// (Recorder::TakeOne), of earlier runs all.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <limits>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "gateway/records/history/batch.h"
#include "gateway/records/history/folder_files.h"
#include "gateway/records/history/history_view.h"

namespace baudgate::history {

/// The place of a reader in the values of a history.
struct Pass {
  std::int64_t run = 0;  ///< 0: before the first run
  /// All values of the run up to `from` have been read. In the span from `from` (exclusive) to
  /// `until` (inclusive) those of the points before `point` (by name) and those of `point` up to
  /// `time`.
  Millis from = 0;
  Millis until = 0;  ///< equal to `from`: no span was begun
  std::string point{};
  Millis time = 0;
  /// Number that is added to the times of the run, so that the results increase for each point
  /// over all runs: 0, unless the clock was set back.
  std::int64_t offset = 0;

  bool in_span() const { return until > from; }
  bool operator==(const Pass&) const = default;
};

struct StoredValue {
  std::string point;
  Entry entry{};
};

/// Values that were deleted or damaged before they were read.
struct LostValues {
  Millis from = 0;
  Millis until = 0;
  std::string why{};
};

struct StoredPart {
  std::vector<StoredValue> values{};
  Pass next{};        ///< the place after `values`
  bool more = false;  ///< false: all values that are complete in the files have been read
  std::vector<LostValues> lost{};
  /// A file that cannot be read now, so that reading waits. Call GiveUp to go on without the file.
  std::optional<UnreadFile> unread{};
  /// True if the place is behind the newest run, so the files are older than the place, or other
  /// files. `next` is then the newest place.
  bool foreign = false;
};

class KeptReader {
 public:
  /// A span ends early if it has more values than this in rows.
  static constexpr std::size_t kMostRows = 20'000;

  explicit KeptReader(std::filesystem::path folder);
  ~KeptReader();
  KeptReader(const KeptReader&) = delete;
  KeptReader& operator=(const KeptReader&) = delete;

  /// Reads at most `most` values after `pass`.
  StoredPart Read(const Pass& pass, std::size_t most);
  /// Returns the place after all values that are complete in the files; run 0: there is no run yet;
  /// empty: the newest file cannot be read now.
  std::optional<Pass> Newest();
  /// Reads on without the file until the file changes; its values count as lost.
  void GiveUp(Millis day);

 private:
  struct Day {
    std::filesystem::file_time_type written{};
    bool settled = false;  // no change can have the time `written` as well
    std::map<std::int64_t, Run> runs{};
    std::optional<UnreadFile> unread{};
    bool given_up = false;
  };
  class Span;

  void Look();
  const Run* Find(const Day& day, std::int64_t run) const;
  std::optional<std::int64_t> RunAfter(std::int64_t run) const;
  std::optional<Millis> BeginOf(std::int64_t run) const;
  std::optional<Millis> EndOf(std::int64_t run) const;
  Pass NewestPlace() const;
  bool Plan(StoredPart& part);
  void Advance(StoredPart& part, std::int64_t next_run);
  Millis CompleteIn(Millis day, std::int64_t run, bool ended) const;

  const std::filesystem::path folder_;
  std::map<Millis, Day> days_;
  std::unique_ptr<Span> span_;  // the span that is being read; null: none
};

}  // namespace baudgate::history
