// SPDX-License-Identifier: Apache-2.0
#include "gateway/records/history/pending_values.h"

#include <algorithm>

namespace baudgate::history {

void PendingValues::Add(Batch&& batch) {
  Number(batch);
  batch_.Append(std::move(batch));
}

void PendingValues::Number(Batch& batch) const {
  for (Run& run : batch.runs) {
    run.number += *runs_before_;
    if (!cut_ || run.number != cut_->number) continue;
    run.began = std::max(run.began, cut_->began);
    run.why = cut_->why;
  }
  for (Sample& sample : batch.samples) sample.run += *runs_before_;
  for (TrendRow& row : batch.trends) row.run += *runs_before_;
}

void PendingValues::CutRun() {
  lost_ = true;
  if (batch_.runs.empty()) return;
  const auto more = static_cast<std::int64_t>(batch_.runs.size());
  *runs_before_ += more;
  for (Run& run : batch_.runs) run.number += more;
  for (Sample& sample : batch_.samples) sample.run += more;
  for (TrendRow& row : batch_.trends) row.run += more;
  Run& first = batch_.runs.front();
  Millis began = first.until;
  for (const Sample& sample : batch_.samples) {
    if (sample.run == first.number) began = std::min(began, sample.entry.time);
  }
  first.began = std::max(first.began, began);
  first.why = RunBegin::dropped;
  cut_ = first;
}

}  // namespace baudgate::history
