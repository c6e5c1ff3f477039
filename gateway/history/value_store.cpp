// SPDX-License-Identifier: Apache-2.0
#include "gateway/history/value_store.h"

#include <fmt/format.h>

#include <algorithm>
#include <system_error>
#include <utility>

namespace baudgate::history {
namespace {

/// That the gateway lives is written so often where nothing else is: disks wear.
constexpr Millis kMark = 10 * kSecond;
/// A reading may come so late that belongs to the hour before.
constexpr Millis kLate = 5 * kSecond;
constexpr Millis kLookEvery = 10 * kSecond;

Millis Apart(Millis a, Millis b) { return a > b ? a - b : b - a; }

}  // namespace

ValueStore::ValueStore(std::filesystem::path folder, std::vector<PointName> names,
                       StoreLimits limits, std::string vfs)
    : folder_(std::move(folder)), names_(std::move(names)), limits_(limits), vfs_(std::move(vfs)) {}

Status ValueStore::Open(Now clocks) {
  if (Status status = OpenTrends(); !status) return status;
  if (runs_before_) return {};
  const Millis now = ToMillis(clocks.wall);
  // The newest file may know of runs that trends.db has lost.
  folder_files_ = vfs_.empty() ? ListFiles(folder_) : FolderFiles{};
  std::int64_t last = known_run_;
  const Millis today = FloorTo(now, kDay);
  std::vector<Millis> looked = {today};
  if (!folder_files_.days.empty() && folder_files_.days.back().day != today) {
    looked.push_back(folder_files_.days.back().day);
  }
  for (const Millis day : looked) {
    auto file = std::make_unique<DayFile>(folder_ / DayFileName(day), names_, vfs_);
    const DayFile::Opened opened = file->Open();
    NoteFile(opened.put_aside, opened.lost);
    if (!opened.ok) return Error{file->error()};
    last = std::max(last, opened.last_run);
    if (day == today) days_[day] = std::move(file);
  }
  runs_before_ = last;
  const auto newest = folder_files_.days.empty() ? std::optional<Millis>()
                                                 : std::optional(folder_files_.days.back().day);
  sure_time_.Begin(clocks, newest);
  return {};
}

void ValueStore::NoteFile(const std::string& put_aside, const std::optional<std::string>& lost) {
  if (!put_aside.empty()) news_.push_back({put_aside});
  if (lost) news_.push_back({*lost});
}

Status ValueStore::OpenTrends() {
  if (trends_) return {};
  auto file = std::make_unique<TrendFile>(folder_ / kTrendsFile, names_, vfs_);
  const TrendFile::Opened opened = file->Open(damaged_trends_);
  NoteFile(opened.put_aside, opened.lost);
  if (!opened.ok) return Error{file->error()};
  damaged_trends_.clear();
  known_run_ = std::max(known_run_, opened.last_run);
  trends_ = std::move(file);
  return {};
}

Result<DayFile*> ValueStore::FileOf(Millis day) {
  auto& file = days_[day];
  if (file) return file.get();
  auto fresh = std::make_unique<DayFile>(folder_ / DayFileName(day), names_, vfs_);
  const auto damage = damaged_days_.find(day);
  const bool damaged = damage != damaged_days_.end();
  const DayFile::Opened opened = fresh->Open(damaged ? damage->second : std::string());
  NoteFile(opened.put_aside, opened.lost);
  if (!opened.put_aside.empty() || (damaged && opened.ok)) CutRun();
  if (!opened.ok) {
    days_.erase(day);
    return Error{fresh->error()};
  }
  damaged_days_.erase(day);
  file = std::move(fresh);
  return file.get();
}

Error ValueStore::Failed(DayFile& file) {
  Error error{file.error()};
  if (!file.damaged()) return error;
  const auto found =
      std::ranges::find_if(days_, [&](const auto& day) { return day.second.get() == &file; });
  damaged_days_[found->first] = error.message;
  days_.erase(found);
  return error;
}

void ValueStore::Number(Batch& batch) const {
  for (Run& run : batch.runs) {
    run.number += *runs_before_;
    if (!cut_ || run.number != cut_->number) continue;
    run.began = std::max(run.began, cut_->began);
    run.why = cut_->why;
  }
  for (Sample& sample : batch.samples) sample.run += *runs_before_;
  for (TrendRow& row : batch.trends) row.run += *runs_before_;
}

/// Whether it has to be closed. A damaged one is named when it is put aside.
bool ValueStore::NoteLook(const OpenFile::Look& look, const std::filesystem::path& path) {
  using Found = OpenFile::Found;
  if (look.found == Found::whole) return false;
  if (look.found != Found::damaged) news_.push_back({path.string() + ": " + look.why});
  return true;
}

void ValueStore::LookAtFiles() {
  using Found = OpenFile::Found;
  bool lost = false;
  std::erase_if(days_, [&](const auto& day) {
    const OpenFile::Look look = day.second->LookAt();
    if (look.found == Found::damaged) damaged_days_[day.first] = look.why;
    lost = lost || look.found == Found::gone || look.found == Found::lost;
    return NoteLook(look, day.second->path());
  });
  const OpenFile::Look look = trends_ ? trends_->LookAt() : OpenFile::Look();
  if (look.found == Found::damaged) damaged_trends_ = look.why;
  if (trends_ && NoteLook(look, trends_->path())) trends_.reset();
  if (lost) CutRun();
}

void ValueStore::Check(const std::set<std::string>& files) {
  std::erase_if(days_, [&](const auto& day) {
    const bool doubted = files.contains(DayFileName(day.first));
    const auto damage = doubted ? day.second->Damage() : std::nullopt;
    if (damage) damaged_days_[day.first] = *damage;
    return damage.has_value();
  });
  if (!trends_ || !files.contains(kTrendsFile)) return;
  damaged_trends_ = trends_->Damage().value_or(std::string());
  if (!damaged_trends_.empty()) trends_.reset();
}

/// The samples that wait begin a new run, because the time of the lost ones is unknown.
void ValueStore::CutRun() {
  lost_ = true;
  if (pending_.runs.empty()) return;
  const auto more = static_cast<std::int64_t>(pending_.runs.size());
  *runs_before_ += more;
  for (Run& run : pending_.runs) run.number += more;
  for (Sample& sample : pending_.samples) sample.run += more;
  for (TrendRow& row : pending_.trends) row.run += more;
  Run& first = pending_.runs.front();
  Millis began = first.until;
  for (const Sample& sample : pending_.samples) {
    if (sample.run == first.number) began = std::min(began, sample.entry.time);
  }
  first.began = std::max(first.began, began);
  first.why = RunBegin::dropped;
  cut_ = first;
}

Status ValueStore::Write(Batch&& batch, Now clocks, bool last) {
  const Millis now = ToMillis(clocks.wall);
  sure_ = sure_time_.Look(clocks);
  Number(batch);
  pending_.Append(std::move(batch));
  LookAtFiles();
  Status status = OpenTrends();
  if (status) status = Clear(now);
  if (status) status = WriteDays(now, last);
  if (status) status = WriteTrends(now);
  if (status) status = Pack(now);
  return status;
}

Status ValueStore::WriteDays(Millis now, bool last) {
  const Millis today = FloorTo(now, kDay);
  const bool due = last || pending_.runs.size() > 1 || Apart(now, marked_) >= kMark;
  const bool mark = due && !pending_.runs.empty();
  // Without samples, what is to be said is that the runs went on.
  while (!pending_.samples.empty() || (mark && marked_ != now)) {
    const bool marks = pending_.samples.empty();
    const Millis day = marks ? today : FloorTo(pending_.samples.front().entry.time, kDay);
    const auto file = FileOf(day);
    if (!file) return Error{file.error()};
    auto& samples = pending_.samples;
    const auto is_of_day = [day](const Sample& sample) {
      return FloorTo(sample.entry.time, kDay) == day;
    };
    const auto other = std::stable_partition(samples.begin(), samples.end(), is_of_day);
    std::vector<Sample> rest(std::make_move_iterator(other),
                             std::make_move_iterator(samples.end()));
    samples.erase(other, samples.end());
    if (!(*file)->Write(pending_.samples, pending_.runs)) {
      pending_.samples.insert(pending_.samples.end(), std::make_move_iterator(rest.begin()),
                              std::make_move_iterator(rest.end()));
      return Failed(**file);
    }
    pending_.samples = std::move(rest);
    if (day == today) marked_ = now;
    if (marks) break;
  }
  return {};
}

Status ValueStore::WriteTrends(Millis now) {
  if (pending_.runs.empty() && pending_.trends.empty()) return {};
  const bool is_new = !pending_.runs.empty() && pending_.runs.back().number > known_run_;
  if (!pending_.trends.empty() || is_new) {
    if (!trends_->Write(pending_.trends, pending_.runs, sure_)) {
      Error error{trends_->error()};
      if (trends_->damaged()) {
        damaged_trends_ = trends_->error();
        trends_.reset();
      }
      return error;
    }
    if (!pending_.runs.empty()) known_run_ = pending_.runs.back().number;
  }
  pending_.trends.clear();
  // Runs that have ended have been told to all; the last is told again.
  if (marked_ == now || pending_.runs.size() > 1) pending_.runs.clear();
  return {};
}

Status ValueStore::Pack(Millis now) {
  const Millis today = FloorTo(now, kDay);
  for (auto at = days_.begin(); at != days_.end();) {
    DayFile& file = *at->second;
    const bool past = at->first != today && now - FloorTo(now, kDay) >= kLate;
    if (!file.packing() && file.open_rows() > 0) {
      const bool hour = FloorTo(file.oldest_row(), kHour) != FloorTo(now - kLate, kHour);
      if (past || hour || file.open_rows() >= limits_.open_rows) file.BeginPacking();
    }
    if (file.packing() && !file.Pack(limits_.pack_each)) return Failed(file);
    if (past && !file.packing() && file.open_rows() == 0) {
      at = days_.erase(at);  // its log goes into the file
    } else {
      ++at;
    }
  }
  return {};
}

/// Makes room before it is needed.
Status ValueStore::Clear(Millis now) {
  if (!vfs_.empty()) return {};
  const Millis today = FloorTo(now, kDay);
  const bool near = folder_files_.bytes() > limits_.bytes / 10 * 9;
  if (!near && Apart(now, looked_) < kLookEvery) return {};
  looked_ = now;
  folder_files_ = ListFiles(folder_);
  for (const TooMuch& file :
       FindTooMuch(folder_files_, limits_.bytes, limits_.keep, today, sure_)) {
    if (file.day) days_.erase(*file.day);
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
