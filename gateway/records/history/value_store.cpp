// SPDX-License-Identifier: Apache-2.0
#include "gateway/records/history/value_store.h"

#include <fmt/format.h>

#include <algorithm>
#include <system_error>
#include <utility>

namespace baudgate::history {
namespace {

/// That the gateway lives is written so often where nothing else is: disks wear.
constexpr Millis kMark = 10 * kSecond;
constexpr Millis kLookEvery = 10 * kSecond;

Millis Apart(Millis a, Millis b) { return a > b ? a - b : b - a; }

}  // namespace

ValueStore::ValueStore(std::filesystem::path folder, std::vector<PointName> names,
                       StoreLimits limits, std::string vfs)
    : folder_(std::move(folder)),
      limits_(limits),
      lists_(vfs.empty()),
      files_(folder_, std::move(names), std::move(vfs), news_) {}

Status ValueStore::Open(Now clocks) {
  if (Status status = files_.OpenTrends(); !status) return status;
  if (pending_.has_begun()) return {};
  const Millis today = FloorTo(ToMillis(clocks.wall), kDay);
  folder_files_ = lists_ ? ListFiles(folder_) : FolderFiles{};
  const auto newest = folder_files_.days.empty() ? std::optional<Millis>()
                                                 : std::optional(folder_files_.days.back().day);
  std::vector<Millis> looked = {today};
  if (newest && *newest != today) looked.push_back(*newest);
  // The newest file may know of runs that trends.db has lost.
  const auto last = files_.OpenDays(looked, today);
  if (!last) return Error{last.error()};
  pending_.Begin(std::max(files_.last_run(), *last));
  sure_time_.Begin(clocks, newest);
  return {};
}

void ValueStore::CutLostRun() {
  if (files_.TakeLost()) pending_.CutRun();
}

Status ValueStore::Write(Batch&& batch, Now clocks, bool last) {
  const Millis now = ToMillis(clocks.wall);
  sure_ = sure_time_.Look(clocks);
  pending_.Add(std::move(batch));
  files_.Look();
  CutLostRun();
  Status status = files_.OpenTrends();
  if (status) status = Clear(now);
  if (status) status = WriteDays(now, last);
  if (status) status = WriteTrends(now);
  if (status) status = files_.Pack(now, limits_);
  return status;
}

Status ValueStore::WriteDays(Millis now, bool last) {
  const Millis today = FloorTo(now, kDay);
  Batch& batch = pending_.batch();
  const bool due = last || batch.runs.size() > 1 || Apart(now, marked_) >= kMark;
  const bool mark = due && !batch.runs.empty();
  // Without samples, what is to be said is that the runs went on.
  while (!batch.samples.empty() || (mark && marked_ != now)) {
    const bool marks = batch.samples.empty();
    const Millis day = marks ? today : FloorTo(batch.samples.front().entry.time, kDay);
    const auto file = files_.Day(day);
    CutLostRun();
    if (!file) return Error{file.error()};
    auto& samples = batch.samples;
    const auto is_of_day = [day](const Sample& sample) {
      return FloorTo(sample.entry.time, kDay) == day;
    };
    const auto other = std::stable_partition(samples.begin(), samples.end(), is_of_day);
    std::vector<Sample> rest(std::make_move_iterator(other),
                             std::make_move_iterator(samples.end()));
    samples.erase(other, samples.end());
    if (!(*file)->Write(samples, batch.runs)) {
      samples.insert(samples.end(), std::make_move_iterator(rest.begin()),
                     std::make_move_iterator(rest.end()));
      return files_.Failed(**file);
    }
    samples = std::move(rest);
    if (day == today) marked_ = now;
    if (marks) break;
  }
  return {};
}

Status ValueStore::WriteTrends(Millis now) {
  Batch& batch = pending_.batch();
  if (batch.runs.empty() && batch.trends.empty()) return {};
  const bool is_new = !batch.runs.empty() && batch.runs.back().number > files_.last_run();
  if (!batch.trends.empty() || is_new) {
    if (Status status = files_.WriteTrends(batch.trends, batch.runs, sure_); !status) return status;
  }
  batch.trends.clear();
  // Runs that have ended have been told to all; the last is told again.
  if (marked_ == now || batch.runs.size() > 1) batch.runs.clear();
  return {};
}

/// Makes room before it is needed.
Status ValueStore::Clear(Millis now) {
  if (!lists_) return {};
  const Millis today = FloorTo(now, kDay);
  const bool near = folder_files_.bytes() > limits_.bytes / 10 * 9;
  if (!near && Apart(now, looked_) < kLookEvery) return {};
  looked_ = now;
  folder_files_ = ListFiles(folder_);
  for (const TooMuch& file :
       FindTooMuch(folder_files_, limits_.bytes, limits_.keep, today, sure_)) {
    if (file.day) files_.CloseDay(*file.day);
    RemoveFile(folder_, file.file);
    news_.push_back({file.file + " is deleted: " + WhyItGoes(file), false});
  }
  folder_files_ = ListFiles(folder_);
  if (folder_files_.bytes() <= Ceiling(limits_.bytes)) return {};
  return Error{fmt::format("history.limit of {} MB is reached: {}; raise it, or keep fewer points",
                           limits_.bytes / config::kMegabyte, Largest(folder_files_))};
}

std::string ValueStore::WhyItGoes(const TooMuch& file) const {
  if (file.old) return "it ended longer ago than history.keep";
  return fmt::format("history.limit of {} MB is reached", limits_.bytes / config::kMegabyte);
}

}  // namespace baudgate::history
