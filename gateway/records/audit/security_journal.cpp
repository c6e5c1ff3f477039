// SPDX-License-Identifier: Apache-2.0
#include "gateway/records/audit/security_journal.h"

#include <fcntl.h>
#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <map>
#include <nlohmann/json.hpp>
#include <set>
#include <thread>
#include <utility>

#include "gateway/base/fair_places.h"
#include "gateway/base/guarded.h"
#include "gateway/base/log.h"
#include "gateway/base/secrets.h"
#include "gateway/base/system_trouble.h"
#include "gateway/base/text.h"
#include "gateway/base/whole_file.h"
#include "gateway/records/audit/audited_writes.h"

namespace baudgate::audit {
namespace {

namespace fs = std::filesystem;
using Json = nlohmann::ordered_json;

constexpr std::string_view kHashKey = ",\"hash\":\"";
constexpr std::size_t kHashTail = 64 + 2;  // the hash, and the characters "} behind it

/// Returns the row without its hash, as it is hashed; empty: the line has no hash.
std::string BodyOf(const std::string& line) {
  const std::size_t at = line.rfind(kHashKey);
  if (at == std::string::npos || line.size() != at + kHashKey.size() + kHashTail) return {};
  return line.substr(0, at) + "}";
}

std::string HashIn(const std::string& line) {
  const std::size_t at = line.rfind(kHashKey);
  return at == std::string::npos ? std::string() : line.substr(at + kHashKey.size(), 64);
}

std::string TextOf(const Json& json, const char* key) {
  const auto found = json.find(key);
  return found != json.end() && found->is_string() ? found->get<std::string>() : std::string();
}

std::vector<std::string> LinesOf(const std::string& text) {
  std::vector<std::string> lines;
  for (std::size_t at = 0; at < text.size();) {
    const std::size_t end = text.find('\n', at);
    if (end == std::string::npos) break;  // a row that a power failure has cut
    lines.push_back(text.substr(at, end - at));
    at = end + 1;
  }
  return lines;
}

}  // namespace

/// The queue and the file. Only the worker uses the members behind the queue.
struct SecurityJournal::File {
  struct Waiting {
    SecurityEvent event;
    WallTime time{};
  };

  /// Takes the rows that wait. Returns how many were lost since the last call.
  std::size_t Take(std::vector<Waiting>& rows) {
    const MutexLock lock(mutex);
    rows.swap(waiting);
    return std::exchange(lost, 0);
  }

  /// Counts the row. False: there were too many of its kind, user and host in this minute. A
  /// command that has changed something always gets its row, however many others have failed.
  bool MayAdd(const SecurityEvent& event, WallTime now) {
    if (event.kind == "command" && event.result.starts_with("ok")) return true;
    // Rows of all users and hosts beyond this number share one count.
    constexpr std::size_t kMostCounts = 256;
    std::string key = event.kind + "\n" + event.who + "\n" + HostOf(event.from);
    const MutexLock lock(mutex);
    if (counts.size() >= kMostCounts && !counts.contains(key)) key = "many\nothers\n";
    Count& count = counts.try_emplace(key, Count{now, 0, event}).first->second;
    count.last = event;
    return ++count.rows <= kMostInAMinute;
  }

  /// Returns a row for each count whose minute is over, or for all, and begins new minutes.
  std::vector<SecurityEvent> Folded(WallTime now, bool all) {
    std::vector<SecurityEvent> rows;
    const MutexLock lock(mutex);
    std::erase_if(counts, [&](const auto& entry) {
      const Count& count = entry.second;
      if (!all && now - count.since < 1min && now >= count.since) return false;
      if (count.rows > kMostInAMinute) {
        rows.push_back(count.last);
        rows.back().result = fmt::format("{} more in a minute, the last: {}",
                                         count.rows - kMostInAMinute, rows.back().result);
      }
      return true;
    });
    return rows;
  }

  fs::path Folder() {
    const MutexLock lock(mutex);
    return its_folder;
  }

  void Round() {
    std::vector<Waiting> rows;
    folder = Folder();
    if (folder.empty()) return;
    const std::size_t gone = Take(rows);
    const std::size_t count = rows.size();
    if (gone > 0) {
      rows.push_back({{"journal", "baudgate", "", fmt::format("{} rows were lost", gone),
                       "the disk did not take them in time"},
                      ReadClocks().wall});
    }
    if (rows.empty()) return;
    std::string text;
    const Status opened = Open();
    for (const Waiting& row : rows) text += opened ? LineOf(row) : std::string();
    const Status written = opened ? Append(text) : opened;
    if (!written) {
      log::WarnFolded("security journal", "the security journal {} cannot be written: {}",
                      (folder / kFile).string(), written.error());
    }
    const MutexLock lock(mutex);
    if (!written) lost += gone + count;
    done += count;
  }

  /// Opens the file, and finds the last row, whose number and hash the next row continues. A row
  /// that a power failure has cut is removed.
  Status Open() {
    const fs::path path = folder / kFile;
    if (descriptor >= 0 && IsAt(path)) return {};
    if (descriptor >= 0) ::close(std::exchange(descriptor, -1));
    std::error_code error;
    fs::create_directories(folder, error);
    const std::string text = ReadWhole(path).value_or(std::string());
    std::vector<std::string> lines = LinesOf(text);
    if (lines.empty()) lines = LinesOf(ReadWhole(folder / kOldFile).value_or(std::string()));
    if (!lines.empty() && number == 0) {
      const Json last = Json::parse(lines.back(), nullptr, false);
      if (last.is_object() && last.contains("n") && last["n"].is_number_integer()) {
        number = last["n"].get<std::int64_t>();
      }
      hash = HashIn(lines.back());
    }
    descriptor = ::open(path.c_str(), O_WRONLY | O_APPEND | O_CREAT | O_CLOEXEC | O_NOFOLLOW, 0640);
    if (descriptor < 0) return Error{SystemTrouble(errno)};
    const std::size_t whole = text.rfind('\n') == std::string::npos ? 0 : text.rfind('\n') + 1;
    if (whole < text.size() && ::ftruncate(descriptor, static_cast<off_t>(whole)) != 0) {
      return Error{SystemTrouble(errno)};
    }
    size = whole;
    return {};
  }

  /// False: the file was removed or replaced since it was opened.
  bool IsAt(const fs::path& path) const {
    struct stat its {};
    struct stat found {};
    return ::fstat(descriptor, &its) == 0 && ::stat(path.c_str(), &found) == 0 &&
           its.st_dev == found.st_dev && its.st_ino == found.st_ino;
  }

  std::string LineOf(const Waiting& row) {
    const Json json = {{"n", ++number},
                       {"time", FormatWallTime(row.time)},
                       {"kind", row.event.kind},
                       {"who", row.event.who},
                       {"from", row.event.from},
                       {"what", row.event.what},
                       {"result", row.event.result},
                       {"prev", hash}};
    const std::string body = json.dump(-1, ' ', false, Json::error_handler_t::replace);
    hash = Sha256Hex(body);
    return body.substr(0, body.size() - 1) + std::string(kHashKey) + hash + "\"}\n";
  }

  Status Append(const std::string& text) {
    std::size_t sent = 0;
    while (sent < text.size()) {
      const ssize_t count = ::write(descriptor, text.data() + sent, text.size() - sent);
      if (count < 0 && errno == EINTR) continue;
      if (count <= 0) return Fail();
      sent += static_cast<std::size_t>(count);
    }
    if (::fdatasync(descriptor) != 0) return Fail();
    size += text.size();
    if (size < kMostBytes) return {};
    ::close(std::exchange(descriptor, -1));
    const int error = MoveFile(folder / kFile, folder / kOldFile);
    return error == 0 ? Status() : Error{SystemTrouble(error)};
  }

  /// Closes the file, so that the next round looks for its last whole row again.
  Status Fail() {
    const int error = errno;
    ::close(std::exchange(descriptor, -1));
    number = 0;  // the next open reads it from the last row of the file
    hash.clear();
    return Error{SystemTrouble(error)};
  }

  ~File() {
    if (descriptor >= 0) ::close(descriptor);
  }

  struct Count {
    WallTime since{};
    int rows = 0;
    SecurityEvent last{};
  };

  Mutex mutex;
  std::map<std::string, Count> counts BAUDGATE_GUARDED_BY(mutex);
  std::set<std::pair<std::uint64_t, std::string>> hosts BAUDGATE_GUARDED_BY(mutex);
  fs::path its_folder BAUDGATE_GUARDED_BY(mutex);
  std::vector<Waiting> waiting BAUDGATE_GUARDED_BY(mutex);
  std::size_t lost BAUDGATE_GUARDED_BY(mutex) = 0;
  std::uint64_t noted BAUDGATE_GUARDED_BY(mutex) = 0;
  std::uint64_t done BAUDGATE_GUARDED_BY(mutex) = 0;

  fs::path folder;  // copy of its_folder
  int descriptor = -1;
  std::int64_t number = 0;
  std::string hash;
  std::size_t size = 0;
};

SecurityJournal::SecurityJournal(const fs::path& folder)
    : file_(std::make_shared<File>()), worker_("security", [file = file_](bool) {
        file->Round();
        return kWhenWoken;
      }) {
  SetFolder(folder);
  worker_.Start();
}

void SecurityJournal::SetFolder(const fs::path& folder) {
  const MutexLock lock(file_->mutex);
  if (file_->its_folder.empty()) file_->its_folder = folder;
}

SecurityJournal::~SecurityJournal() {
  const WallTime now = ReadClocks().wall;
  for (SecurityEvent& folded : file_->Folded(now, true)) Add(std::move(folded), now);
  Flush(1s);
  worker_.Leave();
}

void SecurityJournal::Note(SecurityEvent event, WallTime now) {
  for (std::string* text : {&event.who, &event.from, &event.what, &event.result}) {
    *text = Clipped(WithoutControls(*text));
  }
  for (SecurityEvent& folded : file_->Folded(now, false)) Add(std::move(folded), now);
  if (file_->MayAdd(event, now)) Add(std::move(event), now);
}

void SecurityJournal::Add(SecurityEvent event, WallTime now) {
  log::WriteAct(
      log::Level::info,
      {.fields = {{"SECURITY", event.kind}, {"WHO", event.who}, {"FROM", event.from}}},
      fmt::format("security: {}{}{}: {}: {}", event.kind, event.who.empty() ? "" : " " + event.who,
                  event.from.empty() ? "" : " from " + event.from, event.what, event.result));
  {
    const MutexLock lock(file_->mutex);
    if (file_->its_folder.empty()) return;
    if (file_->waiting.size() >= kMostWaiting) {
      ++file_->lost;
      return;
    }
    ++file_->noted;
    file_->waiting.push_back({std::move(event), now});
  }
  worker_.Wake();
}

void SecurityJournal::NoteHost(const std::string& peer, const std::string& place, WallTime now) {
  {
    const MutexLock lock(file_->mutex);
    auto& hosts = file_->hosts;
    if (hosts.size() >= kMostHosts || !hosts.emplace(HostNumberOf(peer), place).second) return;
  }
  Note({"host", "", HostOf(peer), "first connection at " + place, "ok"}, now);
}

bool SecurityJournal::Flush(Duration patience) {
  constexpr Duration kLook = 5ms;
  for (Duration waited{}; waited <= patience; waited += kLook) {
    {
      const MutexLock lock(file_->mutex);
      if (file_->done >= file_->noted) return true;
    }
    std::this_thread::sleep_for(kLook);
  }
  return false;
}

Result<JournalCheck> VerifyJournal(const fs::path& folder) {
  JournalCheck check;
  std::int64_t number = 0;
  bool any = false;
  for (const char* const name : {SecurityJournal::kOldFile, SecurityJournal::kFile}) {
    const auto text = ReadWhole(folder / name);
    if (!text && errno == ENOENT) continue;
    if (!text && errno == EACCES) {
      return Error{(folder / name).string() +
                   " cannot be read: permission denied; run the command as root or as a member of "
                   "the group baudgate"};
    }
    if (!text) {
      check.faults.push_back((folder / name).string() + " cannot be read: " + SystemTrouble(errno));
      continue;
    }
    const auto fault = [&](std::size_t line, const std::string& what) {
      check.faults.push_back(fmt::format("{}:{}: {}", (folder / name).string(), line, what));
    };
    const std::vector<std::string> lines = LinesOf(*text);
    for (std::size_t i = 0; i < lines.size(); ++i) {
      const Json json = Json::parse(lines[i], nullptr, false);
      const std::string body = BodyOf(lines[i]);
      const bool whole = json.is_object() && json.contains("n") && json["n"].is_number_integer();
      if (!whole || body.empty() || Sha256Hex(body) != HashIn(lines[i])) {
        fault(i + 1, "the row was changed");
        check.last_hash = HashIn(lines[i]);
        ++number;
        continue;
      }
      JournalRow row{json["n"].get<std::int64_t>(),
                     TextOf(json, "time"),
                     {TextOf(json, "kind"), TextOf(json, "who"), TextOf(json, "from"),
                      TextOf(json, "what"), TextOf(json, "result")}};
      const bool follows =
          !any || (row.number == number + 1 && TextOf(json, "prev") == check.last_hash);
      if (!follows) fault(i + 1, "rows before this row are missing or were changed");
      any = true;
      number = row.number;
      check.last_hash = HashIn(lines[i]);
      check.rows.push_back(std::move(row));
    }
    if (!text->empty() && text->back() != '\n') fault(lines.size() + 1, "the last row is cut");
  }
  if (!any && check.faults.empty()) {
    return Error{"there is no security journal in " + folder.string() +
                 " yet; check that gateway.name and gateway.state are those of the gateway"};
  }
  return check;
}

}  // namespace baudgate::audit
