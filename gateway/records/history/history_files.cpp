// SPDX-License-Identifier: Apache-2.0
#include "gateway/records/history/history_files.h"

#include <algorithm>

#include "gateway/records/history/folder_files.h"

namespace baudgate::history {
namespace {

/// A reading may come so late that it belongs to the hour before.
constexpr Millis kLate = 5 * kSecond;

}  // namespace

HistoryFiles::HistoryFiles(std::filesystem::path folder, std::vector<PointName> names,
                           std::string vfs, std::vector<News>& news)
    : folder_(std::move(folder)), names_(std::move(names)), vfs_(std::move(vfs)), news_(news) {}

void HistoryFiles::NoteOpened(const std::string& put_aside,
                              const std::optional<std::string>& lost) {
  if (!put_aside.empty()) news_.push_back({put_aside});
  if (lost) news_.push_back({*lost});
}

Status HistoryFiles::OpenTrends() {
  if (trends_) return {};
  auto file = std::make_unique<TrendFile>(folder_ / kTrendsFile, names_, vfs_);
  const TrendFile::Opened opened = file->Open(damaged_trends_);
  NoteOpened(opened.put_aside, opened.lost);
  if (!opened.ok) return Error{file->error()};
  damaged_trends_.clear();
  last_run_ = std::max(last_run_, opened.last_run);
  trends_ = std::move(file);
  return {};
}

Result<std::int64_t> HistoryFiles::OpenDays(const std::vector<Millis>& days, Millis today) {
  std::int64_t last = 0;
  for (const Millis day : days) {
    auto file = std::make_unique<DayFile>(folder_ / DayFileName(day), names_, vfs_);
    const DayFile::Opened opened = file->Open();
    NoteOpened(opened.put_aside, opened.lost);
    if (!opened.ok) return Error{file->error()};
    last = std::max(last, opened.last_run);
    if (day == today) days_[day] = std::move(file);
  }
  return last;
}

Result<DayFile*> HistoryFiles::Day(Millis day) {
  auto& file = days_[day];
  if (file) return file.get();
  auto fresh = std::make_unique<DayFile>(folder_ / DayFileName(day), names_, vfs_);
  const auto damage = damaged_days_.find(day);
  const bool damaged = damage != damaged_days_.end();
  const DayFile::Opened opened = fresh->Open(damaged ? damage->second : std::string());
  NoteOpened(opened.put_aside, opened.lost);
  if (!opened.put_aside.empty() || (damaged && opened.ok)) lost_ = true;
  if (!opened.ok) {
    days_.erase(day);
    return Error{fresh->error()};
  }
  damaged_days_.erase(day);
  file = std::move(fresh);
  return file.get();
}

Error HistoryFiles::Failed(DayFile& file) {
  Error error{file.error()};
  if (!file.damaged()) return error;
  const auto found =
      std::ranges::find_if(days_, [&](const auto& day) { return day.second.get() == &file; });
  damaged_days_[found->first] = error.message;
  days_.erase(found);
  return error;
}

Status HistoryFiles::WriteTrends(const std::vector<TrendRow>& trends, const std::vector<Run>& runs,
                                 std::optional<Millis> sure) {
  if (!trends_->Write(trends, runs, sure)) {
    Error error{trends_->error()};
    if (trends_->damaged()) {
      damaged_trends_ = trends_->error();
      trends_.reset();
    }
    return error;
  }
  if (!runs.empty()) last_run_ = runs.back().number;
  return {};
}

/// Whether it has to be closed. A damaged one is named when it is put aside.
bool HistoryFiles::NoteLook(const OpenFile::Look& look, const std::filesystem::path& path) {
  using Found = OpenFile::Found;
  if (look.found == Found::whole) return false;
  if (look.found != Found::damaged) news_.push_back({path.string() + ": " + look.why});
  return true;
}

void HistoryFiles::Look() {
  using Found = OpenFile::Found;
  std::erase_if(days_, [&](const auto& day) {
    const OpenFile::Look look = day.second->LookAt();
    if (look.found == Found::damaged) damaged_days_[day.first] = look.why;
    lost_ = lost_ || look.found == Found::gone || look.found == Found::lost;
    return NoteLook(look, day.second->path());
  });
  const OpenFile::Look look = trends_ ? trends_->LookAt() : OpenFile::Look();
  if (look.found == Found::damaged) damaged_trends_ = look.why;
  if (trends_ && NoteLook(look, trends_->path())) trends_.reset();
}

void HistoryFiles::Check(const std::set<std::string>& files) {
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

Status HistoryFiles::Pack(Millis now, const StoreLimits& limits) {
  const Millis today = FloorTo(now, kDay);
  for (auto at = days_.begin(); at != days_.end();) {
    DayFile& file = *at->second;
    const bool past = at->first != today && now - FloorTo(now, kDay) >= kLate;
    if (!file.packing() && file.open_rows() > 0) {
      const bool hour = FloorTo(file.oldest_row(), kHour) != FloorTo(now - kLate, kHour);
      if (past || hour || file.open_rows() >= limits.open_rows) file.BeginPacking();
    }
    if (file.packing() && !file.Pack(limits.pack_each)) return Failed(file);
    if (past && !file.packing() && file.open_rows() == 0) {
      at = days_.erase(at);  // its log goes into the file
    } else {
      ++at;
    }
  }
  return {};
}

}  // namespace baudgate::history
