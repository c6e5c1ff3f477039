// SPDX-License-Identifier: Apache-2.0
#include "gateway/records/history/history_log.h"

#include <fmt/format.h>

#include <algorithm>

namespace baudgate::history {
namespace {

/// The interval at which the end of the present run is written if no values are written. It is
/// long, because each write wears the disk.
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
  // Runs in the newest day's file may be missing in trends.db, so the last run number is taken from
  // both.
  const auto last = files_.OpenDays(looked, today);
  if (!last) return Error{last.error()};
  pending_.Begin(std::max(files_.last_run(), *last));
  sure_time_.Begin(clocks, newest);
  return {};
}

bool ValueStore::CutLostRun() {
  const bool lost = files_.TakeLost();
  if (lost) pending_.CutRun();
  return lost;
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

namespace {

/// Returns the first run of the samples, and the first day of this run.
std::pair<std::int64_t, Millis> FirstOf(const std::vector<Sample>& samples) {
  std::pair first(samples.front().run, FloorTo(samples.front().entry.time, kDay));
  for (const Sample& sample : samples) {
    first = std::min(first, std::pair(sample.run, FloorTo(sample.entry.time, kDay)));
  }
  return first;
}

}  // namespace

Status ValueStore::WriteDays(Millis now, bool last) {
  const Millis today = FloorTo(now, kDay);
  Batch& batch = pending_.batch();
  const bool due = last || batch.runs.size() > 1 || Apart(now, marked_) >= kMark;
  const bool mark = due && !batch.runs.empty();
  // If there are no samples, the runs alone are written, so that the file shows that the present
  // run goes on. Samples are written run by run, and those of a run day by day, so that a reader
  // who sees the end of a run in a file misses no earlier sample.
  while (!batch.samples.empty() || (mark && marked_ != now)) {
    const bool marks = batch.samples.empty();
    const auto [run, day] = marks ? std::pair(std::int64_t{0}, today) : FirstOf(batch.samples);
    const auto file = files_.Day(day);
    // The lost file changes the numbers of the runs.
    if (CutLostRun()) continue;
    if (!file) return Error{file.error()};
    auto& samples = batch.samples;
    const auto is_wanted = [day = day, run = run](const Sample& sample) {
      return sample.run == run && FloorTo(sample.entry.time, kDay) == day;
    };
    const auto other = std::stable_partition(samples.begin(), samples.end(), is_wanted);
    std::vector<Sample> rest(std::make_move_iterator(other),
                             std::make_move_iterator(samples.end()));
    samples.erase(other, samples.end());
    std::vector<Run> runs = batch.runs;
    if (!rest.empty())
      std::erase_if(runs, [run = run](const Run& its) { return its.number > run; });
    if (!(*file)->Write(samples, runs)) {
      samples.insert(samples.end(), std::make_move_iterator(rest.begin()),
                     std::make_move_iterator(rest.end()));
      return files_.Failed(**file);
    }
    samples = std::move(rest);
    if (day == today && samples.empty()) marked_ = now;
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
  // Ended runs are now in all files, so they are dropped here. The present run is written again
  // with the next batch.
  if (marked_ == now || batch.runs.size() > 1) batch.runs.clear();
  return {};
}

/// Deletes files that are too old, or that exceed the size limit. Lists the folder only every
/// kLookEvery, or at each call if the size is near the limit.
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
    news_.push_back({file.file + " was deleted: " + WhyItGoes(file), false});
  }
  folder_files_ = ListFiles(folder_);
  if (folder_files_.bytes() <= Ceiling(limits_.bytes)) return {};
  return Error{fmt::format(
      "history.limit of {} MB is reached: {}; raise history.limit, or record fewer points",
      limits_.bytes / config::kMegabyte, Largest(folder_files_))};
}

std::string ValueStore::WhyItGoes(const TooMuch& file) const {
  if (file.old) return "its day is older than history.keep";
  return fmt::format("history.limit of {} MB is reached", limits_.bytes / config::kMegabyte);
}

namespace {

constexpr const char* kTooSlow = "the disk does not answer in time (check it with dmesg)";
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
                 if (last) WriteOnce(last);  // writes batches that came during the first call
                 return options_.clocks().instant + kCommit;
               }),
      recording_("history", [this](bool last) { return Record(last); }) {
  const MutexLock lock(mutex_);
  const records::DiskCondition opening = disk_;
  view_->Update([&](HistoryState& state) {
    state.folder = options_.folder.string();
    state.points = options_.config->history.points.size();
    state.limit = options_.config->history.limit;
    opening.Fill(state);
  });
  if (options_.folder.empty()) SetDisk(records::Disk::failing, options_.why_no_folder);
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
  options_.warn(fmt::format("history: the gateway stops, and {} values are lost: {}", state.waiting,
                            state.trouble));
}

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
  // While files are opened, the disk does not count as stalled, because opening reads whole files.
  if (!disk_.is_opening() && writing_since_ && now.instant - *writing_since_ > kLongestWrite) {
    SetDisk(records::Disk::stalled, kTooSlow);
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

bool HistoryLog::AreTaken(Instant now) {
  if (!options_.taken || !options_.taken()) return false;
  if (!waits_since_) waits_since_ = now;
  if (now - *waits_since_ <= kLongestWrite) return true;
  const MutexLock lock(mutex_);
  SetDisk(records::Disk::stalled, kTooSlow);
  return true;
}

/// Writes the rest of an earlier batch, then the queue. Until the rest is written, the queue is not
/// read and fills up.
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
  SetDisk(status ? records::Disk::fine : records::Disk::failing,
          status ? std::string() : status.error());
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

void HistoryLog::SetDisk(records::Disk disk, const std::string& trouble) {
  const records::DiskCondition::News news = disk_.Set(disk, trouble, options_.clocks().wall);
  view_->Update([its = disk_](HistoryState& state) { its.Fill(state); });
  if (news.begun) {
    options_.warn(
        fmt::format("history: {}; values wait in a queue until the disk can be written, and are "
                    "dropped when the queue is full",
                    trouble));
  }
  if (news.ended) {
    options_.inform(fmt::format(
        "history: values are recorded again in {}; {} values were dropped since the start",
        options_.folder.string(), view_->state().counters.dropped));
  }
}

}  // namespace baudgate::history
