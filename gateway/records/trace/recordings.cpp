// SPDX-License-Identifier: Apache-2.0
#include "gateway/records/trace/recordings.h"

#include <fmt/format.h>

#include <algorithm>
#include <cerrno>
#include <cstdlib>
#include <fstream>
#include <string_view>
#include <system_error>
#include <utility>
#include <vector>

#include "config/model/config.h"
#include "gateway/base/system_trouble.h"
#include "gateway/records/trace/trace_head.h"

namespace baudgate {
namespace {

namespace fs = std::filesystem;

constexpr std::string_view kEnding = ".trace";

/// "20261121T040506Z".
std::string StampOf(WallTime at) {
  const auto day = std::chrono::floor<std::chrono::days>(at);
  const std::chrono::year_month_day date(day);
  const std::chrono::hh_mm_ss clock(std::chrono::floor<std::chrono::seconds>(at - day));
  return fmt::format("{:04}{:02}{:02}T{:02}{:02}{:02}Z", static_cast<int>(date.year()),
                     static_cast<unsigned>(date.month()), static_cast<unsigned>(date.day()),
                     clock.hours().count(), clock.minutes().count(), clock.seconds().count());
}

bool IsStamp(std::string_view text) {
  constexpr std::string_view kForm = "00000000T000000Z";
  return std::equal(text.begin(), text.end(), kForm.begin(), kForm.end(), [](char c, char form) {
    return form == '0' ? c >= '0' && c <= '9' : c == form;
  });
}

/// Configured names are harmless; this holds whatever they may come to be.
std::string Safe(std::string name) {
  for (char& c : name) {
    const bool plain = (c >= '0' && c <= '9') || (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z');
    if (!plain && c != '-' && c != '_') c = '_';
  }
  return name;
}

std::string FileName(const Recording& recording) {
  return Safe(recording.line->name) + "-" + StampOf(recording.at) + "-" + Safe(recording.name) +
         "-" + recording.reason + std::string(kEnding);
}

std::string Contents(const Recording& recording, const std::string& version,
                     const std::string& file) {
  std::string text = fmt::format(
      "# baudgate {}: the last exchanges of a line, saved at {}\n"
      "# reason: device {}, {}\n"
      "# what they mean: baudgate decode --device {} {}\n"
      "# time (UTC), device, > sent, < received, = outcome and round trip, # note; ** is secret\n",
      version, FormatWallTime(recording.at), recording.name, recording.reason, recording.name,
      file);
  for (const std::string& line : TraceHead(*recording.line)) text += line + "\n";
  for (const TraceRecord& record : recording.records) text += ToText(record) + "\n";
  return text;
}

}  // namespace

fs::path Recordings::FolderOf(const config::Config& config) {
  if (!config.recordings.empty()) return config.recordings;
  const char* state = std::getenv("STATE_DIRECTORY");
  if (state == nullptr || *state == '\0') return {};
  const std::string_view folders(state);
  return fs::path(folders.substr(0, folders.find(':'))) / "recordings";
}

Recordings::Recordings(fs::path folder, std::string version,
                       std::function<void(const std::string&)> trouble)
    : folder_(std::move(folder)),
      version_(std::move(version)),
      trouble_(std::move(trouble)),
      worker_("recordings", [this](bool) {
        WriteAll();
        return failed_ ? ReadClocks().instant + kAgain : kWhenWoken;
      }) {
  worker_.Start();
}

void Recordings::Save(Recording recording) {
  if (waiting_.Put(std::move(recording))) worker_.Wake();
}

void Recordings::WriteAll() {
  if (const auto failed = std::exchange(failed_, std::nullopt)) {
    Write(*failed);
    if (!failed_) trouble_({});
  }
  while (const auto recording = waiting_.Take()) {
    const std::string name = FileName(*recording);
    Write({Safe(recording->line->name), name, Contents(*recording, version_, name)});
  }
}

void Recordings::Write(const File& file) {
  std::error_code error;
  fs::create_directories(folder_, error);
  // One name a line: what a crash leaves is overwritten by the next.
  const fs::path part = folder_ / ("." + file.line + kEnding.data() + ".part");
  errno = 0;
  std::ofstream out(part, std::ios::binary | std::ios::trunc);
  out << file.contents;
  out.close();
  if (!out) {
    error = std::error_code(errno != 0 ? errno : EIO, std::generic_category());
  } else {
    error.clear();
    fs::rename(part, folder_ / file.name, error);
  }
  if (!error) return DropOldest(file.line);
  std::error_code ignored;
  fs::remove(part, ignored);
  trouble_(
      fmt::format("recordings: cannot write to {}: {}; traces of failures are not kept until "
                  "this works again",
                  folder_.string(), SystemTrouble(error.value())));
  failed_ = file;
}

void Recordings::DropOldest(const std::string& line) const {
  std::vector<std::string> names;
  std::error_code error;
  for (fs::directory_iterator entry(folder_, error); !error && entry != fs::directory_iterator();
       entry.increment(error)) {
    const std::string name = entry->path().filename().string();
    const std::string_view rest = std::string_view(name).substr(std::min(line.size(), name.size()));
    if (!name.starts_with(line + "-") || !name.ends_with(kEnding)) continue;
    if (rest.size() > 17 && IsStamp(rest.substr(1, 16)) && rest[17] == '-') names.push_back(name);
  }
  if (names.size() <= kFilesPerLine) return;
  std::sort(names.begin(), names.end());  // by time: the stamp follows the same beginning
  names.resize(names.size() - kFilesPerLine);
  for (const std::string& name : names) fs::remove(folder_ / name, error);
}

}  // namespace baudgate
