// SPDX-License-Identifier: Apache-2.0
#include "gateway/records/history/folder_files.h"

#include <fmt/format.h>

#include <functional>
#include <system_error>
#include <tuple>
#include <utility>

#include "gateway/records/history/day_file.h"
#include "gateway/records/history/history_files.h"

namespace baudgate::history {
namespace {

namespace fs = std::filesystem;

/// True for a file that was put aside. Example: "values-20261123.db.bad2".
bool IsAside(const std::string& name) {
  const bool ours = name.starts_with("values-") || name.starts_with(kTrendsFile);
  return ours && name.find(".db.bad") != std::string::npos;
}

void Add(FolderFiles& folder_files, std::string name, std::uint64_t size,
         fs::file_time_type written) {
  // Readers change the index (-shm), too.
  const bool is_index = name.ends_with("-shm");
  for (const char* part : {"-wal", "-shm"}) {
    if (name.ends_with(part)) name.resize(name.size() - 4);
  }
  if (const auto day = DayOf(name)) {
    auto found = std::ranges::find(folder_files.days, *day, &FolderFiles::Day::day);
    if (found == folder_files.days.end()) found = folder_files.days.insert(found, {*day, 0, {}});
    found->bytes += size;
    if (!is_index) found->written = std::max(found->written, written);
  } else if (name == kTrendsFile) {
    folder_files.trends += size;
  } else if (IsAside(name)) {
    auto found = std::ranges::find(folder_files.aside, name, &FolderFiles::Aside::name);
    if (found == folder_files.aside.end())
      found = folder_files.aside.insert(found, {name, 0, written});
    found->bytes += size;
    found->written = std::max(found->written, written);
  }
}

}  // namespace

std::uint64_t FolderFiles::bytes() const {
  std::uint64_t sum = trends;
  for (const Day& day : days) sum += day.bytes;
  for (const Aside& file : aside) sum += file.bytes;
  return sum;
}

FolderFiles ListFiles(const fs::path& folder) {
  FolderFiles folder_files;
  std::error_code error;
  for (fs::directory_iterator at(folder, error), end; !error && at != end; at.increment(error)) {
    const std::string name = at->path().filename().string();
    std::error_code gone;  // set if the file was removed since the folder was read
    const auto type = at->status(gone).type();
    if (gone || type == fs::file_type::not_found) continue;
    // A folder or FIFO with the name of a day's file is listed with size 0; reading it reports the
    // reason.
    const bool regular = type == fs::file_type::regular;
    const std::uintmax_t size = regular ? at->file_size(gone) : 0;
    const auto written = regular ? at->last_write_time(gone) : fs::file_time_type{};
    if (!gone) Add(folder_files, name, size, written);
  }
  std::ranges::sort(folder_files.days, {}, &FolderFiles::Day::day);
  std::ranges::sort(folder_files.aside,
                    [](const FolderFiles::Aside& a, const FolderFiles::Aside& b) {
                      return std::tie(a.written, a.name) < std::tie(b.written, b.name);
                    });
  return folder_files;
}

std::vector<TooMuch> FindTooMuch(FolderFiles folder_files, std::uint64_t limit, Millis keep,
                                 Millis today, std::optional<Millis> sure) {
  std::vector<TooMuch> gone;
  std::uint64_t bytes = folder_files.bytes();
  std::erase_if(folder_files.days, [&](const FolderFiles::Day& day) {
    const bool old = sure && day.day < today && day.day + kDay + keep <= FloorTo(*sure, kDay);
    if (!old) return false;
    gone.push_back({DayFileName(day.day), day.day, true});
    bytes -= day.bytes;
    return true;
  });
  for (const FolderFiles::Aside& file : folder_files.aside) {
    if (bytes <= Ceiling(limit)) break;
    gone.push_back({file.name});
    bytes -= file.bytes;
  }
  for (const FolderFiles::Day& day : folder_files.days) {
    if (day.day >= today || bytes <= Ceiling(limit)) break;
    gone.push_back({DayFileName(day.day), day.day});
    bytes -= day.bytes;
  }
  return gone;
}

std::string Largest(const FolderFiles& folder_files) {
  std::vector<std::pair<std::uint64_t, std::string>> files = {{folder_files.trends, kTrendsFile}};
  for (const FolderFiles::Day& day : folder_files.days)
    files.emplace_back(day.bytes, DayFileName(day.day));
  for (const FolderFiles::Aside& file : folder_files.aside)
    files.emplace_back(file.bytes, file.name);
  std::ranges::sort(files, std::greater());
  const auto megabytes = [](std::uint64_t bytes) { return static_cast<double>(bytes) / 1e6; };
  std::string text = fmt::format("{} has {:.1f} MB", files[0].second, megabytes(files[0].first));
  if (files.size() > 1 && files[1].first > 0) {
    text += fmt::format(", {} {:.1f} MB", files[1].second, megabytes(files[1].first));
  }
  return text;
}

void RemoveFile(const fs::path& folder, const std::string& file) {
  const std::string path = (folder / file).string();
  std::error_code ignored;
  // The log is removed before its file: SQLite would apply a log without its file to a later file
  // of this name.
  for (const char* part : {"-wal", "-shm", ""}) fs::remove(path + part, ignored);
}

void SureTime::Begin(Now now, std::optional<Millis> newest) {
  began_ = now.instant;
  latest_ = newest ? *newest + kDay : ToMillis(now.wall);
  last_ = now;
  settles_ = now.instant + kSettled;
}

std::optional<Millis> SureTime::Look(Now now) {
  const Duration stepped = now.wall - last_.wall - (now.instant - last_.instant);
  last_ = now;
  if (stepped > kStep || stepped < -kStep) settles_ = now.instant + kSettled;
  if (now.instant < settles_) return std::nullopt;
  const Millis could = latest_ + (now.instant - began_) / 1ms;
  return std::min(ToMillis(now.wall), could);
}

namespace {

constexpr std::uint64_t kEntry = 3;       // bytes per entry in a large chunk
constexpr std::uint64_t kFewEntries = 8;  // bytes per entry in a small chunk
constexpr std::uint64_t kChunk = 60;      // bytes of a chunk with its index; one chunk an hour
constexpr std::uint64_t kSpan = 70;
constexpr std::uint64_t kHoursADay = 24;

Duration PeriodOf(const config::Device& device, const config::Point& point) {
  const Duration period = config::PeriodOf(device, point.group);
  return period == Duration::zero() ? 24h : period;
}

void Add(const config::Device& device, const config::HistoryPoint& its, Estimate& estimate) {
  constexpr Duration kOneDay = 24h;
  const config::Point& point = device.points[its.point];
  const Duration period = std::max<Duration>(PeriodOf(device, point), 1ms);
  const auto readings = static_cast<std::uint64_t>(kOneDay / period);
  const auto repeats = static_cast<std::uint64_t>(kOneDay / std::max(its.max_gap, period));
  const std::uint64_t chunks = kChunk * std::min(kHoursADay, readings);
  const std::uint64_t hours = kSpan * kHoursADay;
  const std::uint64_t most = readings * (readings > 1000 ? kEntry : kFewEntries) + chunks + hours;
  estimate.most += most;
  estimate.least += its.every ? most : std::min(most, repeats * kFewEntries + chunks + hours);
  if (point.type == config::Type::string) return;
  estimate.minutes += kSpan * static_cast<std::uint64_t>(kKeepMinutes / kMinute);
}

}  // namespace

std::uint64_t Estimate::Days(std::uint64_t limit, std::uint64_t bytes_a_day) const {
  if (limit <= minutes || bytes_a_day == 0) return 0;
  return (limit - minutes) / bytes_a_day;
}

Estimate EstimateOf(const config::Config& config) {
  Estimate estimate;
  for (std::size_t line = 0; line < config.lines.size(); ++line) {
    const std::uint32_t first = config::FirstDevice(config, line);
    const auto& devices = config.lines[line].devices;
    for (const config::HistoryPoint& point : config.history.points) {
      if (point.device < first || point.device >= first + devices.size()) continue;
      Add(devices[point.device - first], point, estimate);
    }
  }
  return estimate;
}

}  // namespace baudgate::history
