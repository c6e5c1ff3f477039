// The values that wait to be written, with the numbers of runs as in the files: those of the
// recorder begin at 1 with each start of the gateway.
//
//   Begin(40), Add(run 1)   → run 41
//   CutRun()                → run 42: the file that had the beginning of run 41 is lost
//   Add(run 1)              → run 42, which began where the values go on
//
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <utility>

#include "gateway/records/history/batch.h"

namespace baudgate::history {

class PendingValues {
 public:
  /// `last_run`: the last number in the files. Before the first Add.
  void Begin(std::int64_t last_run) { runs_before_ = last_run; }
  bool has_begun() const { return runs_before_.has_value(); }

  void Add(Batch&& batch);
  /// The file with the kept values is lost: values that wait begin a new run, because the time of
  /// the lost ones is unknown.
  void CutRun();
  /// Since the last call CutRun was called.
  bool TakeLost() { return std::exchange(lost_, false); }

  const Batch& batch() const { return batch_; }
  Batch& batch() { return batch_; }

 private:
  void Number(Batch& batch) const;

  Batch batch_;
  std::optional<std::int64_t> runs_before_;
  std::optional<Run> cut_;  // began in the middle of the recorder's
  bool lost_ = false;
};

}  // namespace baudgate::history
