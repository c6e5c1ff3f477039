// SPDX-License-Identifier: Apache-2.0
#include "gateway/records/history/history_log.h"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

namespace baudgate::history {
namespace {

constexpr const char* kTooSlow = "the disk does not answer in time";
constexpr std::size_t kLeastQueue = 65'536;

std::vector<PointName> NamesOf(const config::Config& config) {
  std::vector<PointName> names;
  for (std::size_t line = 0; line < config.lines.size(); ++line) {
    const std::uint32_t first = config::FirstDevice(config, line);
    const config::Line& its = config.lines[line];
    for (const config::HistoryPoint& point : config.history.points) {
      if (point.device < first || point.device >= first + its.devices.size()) continue;
      const config::Device& device = its.devices[point.device - first];
      const config::Point& one = device.points[point.point];
      names.push_back({its.name + "." + device.name + "." + one.name, one.type});
    }
  }
  return names;
}

StoreLimits LimitsOf(const config::History& history) {
  StoreLimits limits;
  limits.bytes = history.limit;
  limits.keep = history.keep / std::chrono::milliseconds(1);
  return limits;
}

}  // namespace

HistoryLog::HistoryLog(Options options)
    : options_(std::move(options)),
      view_(std::make_shared<HistoryView>(HistoryView::Options{
          options_.folder, options_.why_no_folder, options_.warn, options_.inform})),
      recorder_(options_.config->history, *options_.store, options_.clocks()),
      files_(options_.folder, NamesOf(*options_.config), LimitsOf(options_.config->history),
             options_.vfs),
      queue_(std::max(kLeastQueue, 4 * options_.config->history.points.size())),
      disk_(options_.clocks().wall),
      writing_("history files",
               [this](bool last) {
                 WriteOnce(last);
                 if (last) WriteOnce(last);  // what came while an earlier rest was written
                 return options_.clocks().instant + kCommit;
               }),
      recording_("history", [this](bool last) { return Record(last); }) {
  const MutexLock lock(mutex_);
  const DiskCondition opening = disk_;
  view_->Update([&](HistoryState& state) {
    state.folder = options_.folder.string();
    state.points = options_.config->history.points.size();
    state.limit = options_.config->history.limit;
    opening.Fill(state);
  });
  if (options_.folder.empty()) SetDisk(Disk::failing, options_.why_no_folder);
  recording_.Start();
  writing_.Start();
}

HistoryLog::~HistoryLog() {
  recording_.RequestStop();
  recorder_.Wake();
  recording_.Stop();
  writing_.Stop();
  const HistoryState state = view_->state();
  if (state.trouble.empty() || state.waiting == 0) return;
  options_.warn(fmt::format("history: the gateway ends, and {} values are not kept: {}",
                            state.waiting, state.trouble));
}

// ---------------------------------------------------------------- the recording thread

/// Waits in the feed for what changes, until the next tick.
Instant HistoryLog::Record(bool last) {
  recorder_.Wait(last);
  std::size_t room = 0;
  bool anew = false;
  {
    const MutexLock lock(mutex_);
    room = queue_.Room();
    anew = std::exchange(begin_anew_, false);
  }
  const Now now = options_.clocks();
  Batch batch = recorder_.Take(now, room, anew, last);
  const MutexLock lock(mutex_);
  HandOver(std::move(batch));
  // Opening takes as long as reading the file.
  if (!disk_.is_opening() && writing_since_ && now.instant - *writing_since_ > kLongestWrite) {
    SetDisk(Disk::stalled, kTooSlow);
  }
  return now.instant + kLook;
}

void HistoryLog::HandOver(Batch&& batch) {
  const std::size_t dropped = queue_.Add(std::move(batch));
  view_->Update([&](HistoryState& state) {
    state.trends_dropped += dropped;
    state.counters = recorder_.counters();
  });
}

// ---------------------------------------------------------------- the writing thread

bool HistoryLog::AreTaken(Instant now) {
  if (!options_.taken || !options_.taken()) return false;
  if (!waits_since_) waits_since_ = now;
  if (now - *waits_since_ <= kLongestWrite) return true;
  const MutexLock lock(mutex_);
  SetDisk(Disk::stalled, kTooSlow);
  return true;
}

/// What waits in the files goes first; the queue is left alone until then, and fills up.
void HistoryLog::WriteOnce(bool last) {
  if (options_.folder.empty()) {
    const MutexLock lock(mutex_);
    queue_.TakeAll();
    return;
  }
  const Now clocks = options_.clocks();
  if (AreTaken(clocks.instant)) return;
  {
    const MutexLock lock(mutex_);
    writing_since_ = clocks.instant;
  }
  Status status = options_.ready ? options_.ready() : Status();
  if (status) status = files_.Open(clocks);
  if (clocks.instant >= look_at_) {
    look_at_ = clocks.instant + kLookAgain;
    files_.Check(view_->TakeDoubts());
    view_->LookAgain();
  }
  if (status) {
    Batch batch;
    if (!files_.waits()) {
      const MutexLock lock(mutex_);
      batch = queue_.TakeAll();
    }
    status = files_.Write(std::move(batch), clocks, last);
  }
  for (const News& news : files_.TakeNews()) {
    (news.trouble ? options_.warn : options_.inform)("history: " + news.text);
  }
  const MutexLock lock(mutex_);
  ShowFiles();
  writing_since_.reset();
  if (files_.TakeLost()) begin_anew_ = true;
  SetDisk(status ? Disk::fine : Disk::failing, status ? std::string() : status.error());
}

void HistoryLog::ShowFiles() {
  const FolderFiles& folder = files_.folder_files();
  const std::size_t waiting = queue_.samples() + files_.waiting();
  view_->Update([&](HistoryState& state) {
    state.waiting = waiting;
    state.bytes = folder.bytes();
    state.oldest = folder.days.empty() ? WallTime{} : ToWall(folder.days[0].day);
    state.put_aside.clear();
    for (const FolderFiles::Aside& file : folder.aside) state.put_aside.push_back(file.name);
  });
}

/// The log hears of the first trouble and of its end.
void HistoryLog::SetDisk(Disk disk, const std::string& trouble) {
  const DiskCondition::News news = disk_.Set(disk, trouble, options_.clocks().wall);
  view_->Update([its = disk_](HistoryState& state) { its.Fill(state); });
  if (news.begun) {
    options_.warn(fmt::format(
        "history: {}; values wait until it works again, and are dropped when there is no room for "
        "more",
        trouble));
  }
  if (news.ended) {
    options_.inform(fmt::format("history: values are kept again in {}; {} were dropped",
                                options_.folder.string(), view_->state().counters.dropped));
  }
}

}  // namespace baudgate::history
