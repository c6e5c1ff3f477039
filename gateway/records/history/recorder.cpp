// SPDX-License-Identifier: Apache-2.0
#include "gateway/records/history/recorder.h"

#include <algorithm>
#include <cmath>

#include "gateway/records/history/chunk.h"

namespace baudgate::history {
namespace {

bool HasMoved(const Decimal& deadband, const Value& from, const Value& to) {
  if (from == to) return false;
  if (deadband == 0) return true;
  const auto before = Decimal::Of(from);
  const auto now = Decimal::Of(to);
  return !before || !now || Abs(*now - *before) > deadband;
}

}  // namespace

LogRule LogRule::Of(const config::HistoryPoint& point) {
  return {point.every, point.deadband, point.max_gap / std::chrono::milliseconds(1)};
}

bool IsKept(const LogRule& rule, const Entry* last, const Entry& now) {
  if (last == nullptr || rule.every || now.quality != last->quality) return true;
  if (now.time - last->time >= rule.max_gap) return true;
  return HasMoved(rule.deadband, last->value, now.value);
}

namespace {

/// Returns the value as it is stored: empty if the quality is bad or the value is NaN; a long text
/// is cut.
Value Cleaned(Value value, Quality quality) {
  if (IsBad(quality)) return {};
  if (auto* text = std::get_if<std::string>(&value); text != nullptr) {
    if (text->size() > kLongestText) text->resize(kLongestText);
  } else if (const auto* number = std::get_if<double>(&value)) {
    if (std::isnan(*number)) return {};
  }
  return value;
}

std::optional<double> NumberOf(const Entry& entry) {
  if (!IsGood(entry.quality) || !HasValue(entry.value)) return std::nullopt;
  if (std::holds_alternative<std::string>(entry.value)) return std::nullopt;
  return ToDouble(entry.value);
}

}  // namespace

void Batch::SetRun(const Run& run) {
  if (!runs.empty() && runs.back().number == run.number) {
    runs.back() = run;
  } else {
    runs.push_back(run);
  }
}

void Batch::Append(Batch&& later) {
  for (const Run& run : later.runs) SetRun(run);
  const auto move = [](auto& from, auto& to) {
    to.insert(to.end(), std::make_move_iterator(from.begin()), std::make_move_iterator(from.end()));
    from.clear();
  };
  move(later.samples, samples);
  move(later.trends, trends);
  later.runs.clear();
}

Recorder::Recorder(const config::History& history, const bus::PointStore& store, Now now)
    : store_(store), last_(now) {
  for (std::uint32_t device = 0; device < store.device_count(); ++device) {
    numbers_.emplace_back(store.point_count(device), kNone);
  }
  for (const config::HistoryPoint& point : history.points) {
    numbers_[point.device][point.point] = static_cast<PointNumber>(points_.size());
    points_.emplace_back(point);
  }
  const Millis time = ToMillis(now.wall);
  run_ = {1, time, time, RunBegin::started};
}

void Recorder::Take(const bus::Changes& changes, Now now, std::size_t room, Batch& out) {
  Look(now, room, out);
  const Millis time = ToMillis(now.wall);
  for (std::size_t i = 0; i < changes.points.size();) {
    const std::uint32_t device = changes.points[i].device;
    seen_.clear();
    std::size_t end = i;
    while (end < changes.points.size() && changes.points[end].device == device) ++end;
    // A reload has added the device, and will replace this recorder.
    if (device >= numbers_.size()) {
      i = end;
      continue;
    }
    const auto changed = std::span(changes.points).subspan(i, end - i);
    i = end;
    store_.Read(device, [&](const bus::DeviceRecord& record) {
      for (const auto [its, point] : changed) {
        const PointNumber number = numbers_[device][point];
        if (number == kNone) continue;
        const bus::PointRecord& held = record.points[point];
        seen_.push_back({number, held.value, QualityAt(record, point, now.instant), held.seq,
                         held.source_time});
      }
    });
    for (Seen& seen : seen_) TakeOne(seen, time, out);
  }
  run_.until = std::max(run_.until, recording_ ? time : run_.until);
  out.SetRun(run_);
}

void Recorder::TakeOne(Seen& seen, Millis now, Batch& out) {
  Point& point = points_[seen.point];
  const bool reading = seen.seq != point.seq;
  if (reading) {
    ++counters_.readings;
    counters_.merged += seen.seq - point.seq - 1;
    point.seq = seen.seq;
  }
  // Readers count on this: all values up to kSettle before the end of a run are in the files.
  const Millis least = std::max(run_.began, run_.until - kSettle + 1);
  Millis time = std::max(now, least);
  if (reading) time = std::clamp(ToMillis(seen.source_time), least, time);
  if (point.latest) time = std::max(time, point.latest->time + 1);
  const Entry entry{time, Cleaned(std::move(seen.value), seen.quality), seen.quality};
  const std::optional<double> number = NumberOf(entry);
  point.minute.Set(time, number, reading, ended_);
  Emit(seen.point, kMinute, out);
  point.hour.Set(time, number, reading, ended_);
  Emit(seen.point, kHour, out);
  Offer(seen.point, entry, out);
  point.latest = entry;
}

void Recorder::Offer(PointNumber number, const Entry& entry, Batch& out) {
  Point& point = points_[number];
  if (IsKept(point.rule, point.kept ? &*point.kept : nullptr, entry)) Keep(number, entry, out);
}

void Recorder::Keep(PointNumber number, const Entry& entry, Batch& out) {
  if (recording_ && out.samples.size() >= room_) {
    recording_ = false;
    run_.until = std::max(run_.began, entry.time);
    for (Point& point : points_) point.kept.reset();
  }
  if (!recording_) {
    ++counters_.dropped;
    return;
  }
  ++counters_.kept;
  run_.until = std::max(run_.until, entry.time);
  out.samples.push_back({number, run_.number, entry});
  points_[number].kept = entry;
}

void Recorder::Look(Now now, std::size_t room, Batch& out) {
  room_ = room;
  const Duration passed = now.instant - last_.instant;
  const Duration stepped = now.wall - last_.wall - passed;
  const WallTime without = last_.wall + passed;
  const Millis looked = ToMillis(last_.wall);
  last_ = now;
  if (passed > kStandstill) return EndStandstill(looked, now, out);
  if (stepped > kStep || stepped < -kStep) SetClock(ToMillis(without), ToMillis(now.wall), out);
  if (!recording_ && room >= 2 * points_.size())
    BeginRun(RunBegin::dropped, ToMillis(now.wall), out);
}

/// Begins a run and stores all present values again, so that a reader of the run needs no earlier
/// run.
void Recorder::BeginRun(RunBegin why, Millis now, Batch& out) {
  out.SetRun(run_);
  run_ = {run_.number + 1, now, now, why};
  recording_ = true;
  for (PointNumber number = 0; number < points_.size(); ++number) {
    Point& point = points_[number];
    point.kept.reset();
    if (!point.latest) continue;
    point.latest->time = why == RunBegin::clock ? now : std::max(now, point.latest->time);
    Offer(number, *point.latest, out);
  }
  out.SetRun(run_);
}

void Recorder::BeginAnew(Now now, std::size_t room, Batch& out) {
  Look(now, room, out);
  if (recording_) BeginRun(RunBegin::dropped, ToMillis(now.wall), out);
}

void Recorder::ForgetSpans(Millis time, Batch& out) {
  Roll([&](Rollup& rollup) { rollup.Forget(time, ended_); }, out);
}

/// Handles a standstill of the process, which makes a gap. Points start again with their present
/// values in the store, because the last values that the recorder has can be too old.
void Recorder::EndStandstill(Millis old_time, Now now, Batch& out) {
  ForgetSpans(old_time, out);
  if (recording_) run_.until = std::max(run_.until, old_time);
  for (Point& point : points_) point.latest.reset();
  BeginRun(RunBegin::standstill, ToMillis(now.wall), out);
  TakeAll(now, out);
}

void Recorder::TakeAll(Now now, Batch& out) {
  for (std::uint32_t device = 0; device < numbers_.size(); ++device) {
    seen_.clear();
    store_.Read(device, [&](const bus::DeviceRecord& record) {
      for (std::uint32_t point = 0; point < numbers_[device].size(); ++point) {
        const PointNumber number = numbers_[device][point];
        if (number == kNone) continue;
        const bus::PointRecord& held = record.points[point];
        seen_.push_back({number, held.value, QualityAt(record, point, now.instant), held.seq,
                         held.source_time});
      }
    });
    for (Seen& seen : seen_) TakeOne(seen, ToMillis(now.wall), out);
  }
}

void Recorder::SetClock(Millis old_time, Millis new_time, Batch& out) {
  ForgetSpans(old_time, out);
  for (Point& point : points_) {
    if (!point.latest) continue;
    const std::optional<double> value = NumberOf(*point.latest);
    point.minute.Set(new_time, value, false, ended_);
    point.hour.Set(new_time, value, false, ended_);
  }
  if (recording_) {
    run_.until = std::max(run_.until, old_time);
    BeginRun(RunBegin::clock, new_time, out);
    return;
  }
  for (Point& point : points_) {
    if (point.latest) point.latest->time = new_time;
  }
}

void Recorder::Tick(Now now, std::size_t room, Batch& out) {
  Look(now, room, out);
  const Millis time = ToMillis(now.wall);
  Roll([&](Rollup& rollup) { rollup.Advance(time - kSettle, ended_); }, out);
  if (recording_) run_.until = std::max(run_.until, time);
  out.SetRun(run_);
}

void Recorder::End(Now now, Batch& out) {
  Look(now, 0, out);
  const Millis time = ToMillis(now.wall);
  ForgetSpans(time, out);
  if (recording_) run_.until = std::max(run_.until, time);
  out.SetRun(run_);
}

template <typename Each>
void Recorder::Roll(Each each, Batch& out) {
  for (PointNumber number = 0; number < points_.size(); ++number) {
    if (!points_[number].latest) continue;
    each(points_[number].minute);
    Emit(number, kMinute, out);
    each(points_[number].hour);
    Emit(number, kHour, out);
  }
}

void Recorder::Emit(PointNumber number, Millis width, Batch& out) {
  for (const Trend& trend : ended_) out.trends.push_back({number, run_.number, width, trend});
  ended_.clear();
}

ChangeRecorder::ChangeRecorder(const config::History& history, bus::PointStore& store, Now now)
    : store_(store), feed_(store.Subscribe()), recorder_(history, store, now) {}

Batch ChangeRecorder::Take(Now now, std::size_t room, bool anew, bool last) {
  Batch batch;
  recorder_.Take(changes_, now, room, batch);
  if (anew) recorder_.BeginAnew(now, room, batch);
  if (now.instant >= tick_) {
    recorder_.Tick(now, room, batch);
    tick_ = now.instant + kTick;
  }
  if (last) recorder_.End(now, batch);
  return batch;
}

}  // namespace baudgate::history
