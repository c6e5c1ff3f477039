// SPDX-License-Identifier: Apache-2.0
#include "gateway/records/history/batch.h"

#include <cmath>

namespace baudgate::history {
namespace {

/// The sums are scaled by this factor, so that they do not overflow: the milliseconds of an hour,
/// times twice the largest double, times this factor, fit into a double. A power of two loses no
/// digits.
constexpr double kSmall = 0x1p-24;

double Within(double mean, const Trend& trend) {
  return std::max(trend.min, std::min(trend.max, mean));
}

}  // namespace

void Merge(Trend& trend, const Trend& later) {
  const auto share = static_cast<double>(later.good) / static_cast<double>(trend.good + later.good);
  const double mean = trend.mean * kSmall;
  trend.min = std::min(trend.min, later.min);
  trend.max = std::max(trend.max, later.max);
  trend.mean = Within((mean + (later.mean * kSmall - mean) * share) / kSmall, trend);
  trend.last = later.last;
  trend.count += later.count;
  trend.good += later.good;
}

void Rollup::Set(Millis time, std::optional<double> value, bool reading, std::vector<Trend>& out) {
  Advance(time, out);
  if (value && !std::isfinite(*value)) value.reset();
  value_ = value;
  if (value_ && reading) ++span_.count;
}

void Rollup::Advance(Millis time, std::vector<Trend>& out) {
  if (!begun_) {
    begun_ = true;
    now_ = time;
    span_ = {};
    span_.begin = FloorTo(time, width_);
    sum_ = 0;
    return;
  }
  while (time >= span_.begin + width_) {
    const Millis end = span_.begin + width_;
    Hold(now_, end);
    now_ = end;
    Close(out);
    // Without a value, skips all spans up to `time` in one step.
    span_.begin = value_ ? end : FloorTo(time, width_);
    if (!value_) now_ = time;
  }
  Hold(now_, time);
  now_ = std::max(now_, time);
}

void Rollup::Forget(Millis time, std::vector<Trend>& out) {
  Advance(time, out);
  Close(out);
  begun_ = false;
  value_.reset();
}

void Rollup::Hold(Millis from, Millis until) {
  if (!value_ || until <= from) return;
  const double value = *value_;
  if (span_.good == 0) {
    span_.first = span_.min = span_.max = value;
    sum_ = 0;
  }
  span_.min = std::min(span_.min, value);
  span_.max = std::max(span_.max, value);
  span_.last = value;
  sum_ += (value * kSmall - span_.first * kSmall) * static_cast<double>(until - from);
  span_.good += until - from;
}

void Rollup::Close(std::vector<Trend>& out) {
  if (span_.good > 0) {
    const double mean = span_.first * kSmall + sum_ / static_cast<double>(span_.good);
    span_.mean = Within(mean / kSmall, span_);
    out.push_back(span_);
  }
  const Millis begin = span_.begin;
  span_ = {};
  span_.begin = begin;
  sum_ = 0;
}

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
