// SPDX-License-Identifier: Apache-2.0
#include "gateway/history/history_log.h"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

namespace baudgate::history {
namespace {

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
      most_samples_(std::max(kLeastQueue, 4 * options_.config->history.points.size())),
      most_trends_(most_samples_),
      feed_(options_.store->Subscribe()),
      recorder_(options_.config->history, *options_.store, options_.clocks()),
      files_(options_.folder, NamesOf(*options_.config), LimitsOf(options_.config->history),
             options_.vfs),
      writing_("history files",
               [this](bool last) {
                 WriteOnce(last);
                 if (last) WriteOnce(last);  // what came while an earlier rest was written
                 return options_.clocks().instant + kCommit;
               }),
      recording_("history", [this](bool last) { return Record(last); }) {
  {
    const MutexLock lock(mutex_);
    state_.folder = options_.folder.string();
    state_.points = options_.config->history.points.size();
    state_.limit = options_.config->history.limit;
    state_.since = options_.clocks().wall;
    if (options_.folder.empty()) Show(Disk::failing, options_.why_no_folder);
  }
  recording_.Start();
  writing_.Start();
}

HistoryLog::~HistoryLog() {
  recording_.RequestStop();
  feed_->Wake();
  recording_.Stop();
  writing_.Stop();
  options_.store->Unsubscribe(feed_);
  const MutexLock lock(mutex_);
  if (state_.trouble.empty() || state_.waiting == 0) return;
  options_.warn(fmt::format("history: the gateway ends, and {} values are not kept: {}",
                            state_.waiting, state_.trouble));
}

HistoryState HistoryLog::state() const {
  const MutexLock lock(mutex_);
  HistoryState state = state_;
  state.unread = unread_;
  return state;
}

Result<Page> HistoryLog::Read(const PageQuery& query) const {
  if (options_.folder.empty()) return Error{options_.why_no_folder};
  if (state().disk == Disk::opening) return Page{.next = query.after, .known = true};
  auto page = ReadPage(options_.folder, query);
  if (page) TellUnread(page->unread);
  return page;
}

/// Once each: a file that is damaged while the gateway runs is seen by who reads it first.
void HistoryLog::TellUnread(const std::vector<std::string>& unread) const {
  constexpr std::size_t kMost = 16;
  for (const std::string& text : unread) {
    {
      const MutexLock lock(mutex_);
      const bool known = std::ranges::find(unread_, text) != unread_.end();
      if (known || unread_.size() >= kMost) continue;
      unread_.push_back(text);
    }
    options_.warn("history: " + text + "; its values are missing in answers");
  }
}

Result<TrendPage> HistoryLog::ReadTrends(const TrendQuery& query) const {
  if (options_.folder.empty()) return Error{options_.why_no_folder};
  if (state().disk == Disk::opening) return TrendPage{.next = query.since, .known = true};
  return history::ReadTrends(options_.folder, query);
}

// ---------------------------------------------------------------- the recording thread

/// Waits in the feed for what changes, until the next tick.
Instant HistoryLog::Record(bool last) {
  feed_->Drain(last ? Instant() : tick_, changes_);
  std::size_t room = 0;
  bool anew = false;
  {
    const MutexLock lock(mutex_);
    room = Room();
    anew = std::exchange(begin_anew_, false);
  }
  const Now now = options_.clocks();
  Batch batch;
  recorder_.Take(changes_, now, room, batch);
  if (anew) recorder_.BeginAnew(now, room, batch);
  if (now.instant >= tick_) {
    recorder_.Tick(now, room, batch);
    tick_ = now.instant + kCommit;
  }
  if (last) recorder_.End(now, batch);
  const MutexLock lock(mutex_);
  HandOver(std::move(batch));
  const bool opening = state_.disk == Disk::opening;  // which takes as long as reading the file
  if (!opening && writing_since_ && now.instant - *writing_since_ > kLongestWrite) {
    Show(Disk::stalled, "the disk does not answer in time");
  }
  return now.instant + kLook;
}

void HistoryLog::HandOver(Batch&& batch) {
  // Spans have a queue of their own: there are few, and they are worth more.
  if (queue_.trends.size() + batch.trends.size() > most_trends_) {
    state_.trends_dropped += batch.trends.size();
    batch.trends.clear();
  }
  queue_.Append(std::move(batch));
  state_.counters = recorder_.counters();
}

std::size_t HistoryLog::Room() const {
  return most_samples_ - std::min(most_samples_, queue_.samples.size());
}

// ---------------------------------------------------------------- the writing thread

/// What waits in the files goes first; the queue is left alone until then, and fills up.
void HistoryLog::WriteOnce(bool last) {
  if (options_.folder.empty()) {
    const MutexLock lock(mutex_);
    queue_ = {};
    return;
  }
  const Now clocks = options_.clocks();
  {
    const MutexLock lock(mutex_);
    writing_since_ = clocks.instant;
  }
  Status status = options_.ready ? options_.ready() : Status();
  if (status) status = files_.Open(clocks);
  if (status) {
    Batch batch;
    if (!files_.waits()) {
      const MutexLock lock(mutex_);
      std::swap(batch, queue_);
    }
    status = files_.Write(std::move(batch), clocks, last);
  }
  for (const News& news : files_.TakeNews()) {
    (news.trouble ? options_.warn : options_.inform)("history: " + news.text);
  }
  const MutexLock lock(mutex_);
  state_.waiting = queue_.samples.size() + files_.waiting();
  state_.bytes = files_.folder_files().bytes();
  state_.oldest =
      files_.folder_files().days.empty() ? WallTime{} : ToWall(files_.folder_files().days[0].day);
  writing_since_.reset();
  if (files_.TakeLost()) begin_anew_ = true;
  Show(status ? Disk::fine : Disk::failing, status ? std::string() : status.error());
}

/// The log hears of the first trouble and of its end.
void HistoryLog::Show(Disk disk, const std::string& trouble) {
  const bool was_in_trouble = !std::exchange(state_.trouble, trouble).empty();
  if (std::exchange(state_.disk, disk) != disk) state_.since = options_.clocks().wall;
  if (!trouble.empty() && !was_in_trouble) {
    options_.warn(fmt::format(
        "history: {}; values wait until it works again, and are dropped when there is no room for "
        "more",
        trouble));
  } else if (trouble.empty() && was_in_trouble) {
    options_.inform(fmt::format("history: values are kept again in {}; {} were dropped",
                                state_.folder, state_.counters.dropped));
  }
}

}  // namespace baudgate::history
