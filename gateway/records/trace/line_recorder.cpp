// SPDX-License-Identifier: Apache-2.0
#include "gateway/records/trace/line_recorder.h"

#include <fmt/format.h>

#include <algorithm>
#include <cerrno>
#include <cstdlib>
#include <fstream>
#include <string_view>
#include <system_error>
#include <utility>

#include "gateway/base/system_trouble.h"
#include "gateway/base/text.h"

namespace baudgate::records {
namespace {

constexpr std::size_t kMostText = 256;  // limit of the bytes of a reason or note
// An exchange takes no more notes when it has kMostItems + kMostNotes items.
constexpr std::size_t kMostNotes = 32;

char Shown(std::uint8_t byte) {
  return byte >= 0x20 && byte < 0x7F ? static_cast<char>(byte) : '.';
}

std::vector<bool> MaskOf(const protocols::Request& request) {
  std::vector<bool> mask(request.bytes.size());
  for (const auto& [at, count] : request.expect.secrets) {
    for (std::size_t i = at; i - at < count && i < mask.size(); ++i) mask[i] = true;
  }
  return mask;
}

}  // namespace

LineRecorder::LineRecorder(const config::Line& line, std::uint32_t first_device, Sink sink)
    : line_(line), first_device_(first_device), sink_(std::move(sink)) {}

void LineRecorder::Exchange::Clear() {
  items.clear();
  bytes.clear();
  masked.clear();
  on_wire = left_out = 0;
}

void LineRecorder::Exchange::Keep(Item item, View content) {
  item.begin = static_cast<std::uint16_t>(bytes.size());
  Append(bytes, content);
  item.end = static_cast<std::uint16_t>(bytes.size());
  const bool goes_on = item.kind == TraceRecord::Kind::received && items.size() >= kMostItems &&
                       items.back().kind == TraceRecord::Kind::received;
  if (goes_on) {
    items.back().end = item.end;
  } else {
    items.push_back(item);
  }
}

void LineRecorder::OnSent(std::uint32_t device, const protocols::Request& request, Now now) {
  const MutexLock lock(mutex_);
  Begin();
  asked_ = device;
  masks_received_ = !request.expect.secrets.empty();
  if (masks_received_) last_secret_ = now.instant;
  AddBytes({.kind = TraceRecord::Kind::sent, .device = device, .at = now.wall}, request.bytes,
           masks_received_ ? MaskOf(request) : std::vector<bool>());
}

void LineRecorder::OnReceived(View bytes, Now now) {
  const MutexLock lock(mutex_);
  BeginUnasked(now);
  AddBytes({.kind = TraceRecord::Kind::received, .device = asked_, .at = now.wall}, bytes,
           std::vector<bool>(masks_received_ ? bytes.size() : 0, true));
}

void LineRecorder::OnExchangeEnd(std::uint32_t device, const bus::ExchangeEnd& end, Now now) {
  std::optional<Recording> recording;
  {
    const MutexLock lock(mutex_);
    asked_ = kNoDevice;
    ended_ = now.instant;
    Item item{.kind = TraceRecord::Kind::end, .outcome = end.outcome, .device = device};
    item.at = now.wall;
    item.round_trip = end.round_trip;
    Add(item, IsQuotable(now) ? end.reason : std::string());
    if (end.outcome == Outcome::corrupt) recording = Save(device, "corrupt", now);
  }
  if (recording) sink_(std::move(*recording));
}

void LineRecorder::OnDeviceState(std::uint32_t device, bus::DeviceState to,
                                 const std::string& reason, Now now) {
  std::optional<Recording> recording;
  {
    const MutexLock lock(mutex_);
    const bool quotable = !reason.empty() && IsQuotable(now);
    Add({.device = device, .at = now.wall},
        std::string(Name(to)) + (quotable ? ": " + reason : std::string()));
    if (to == bus::DeviceState::offline) recording = Save(device, "offline", now);
  }
  if (recording) sink_(std::move(*recording));
}

void LineRecorder::OnPort(const std::string& text, Now now) {
  const MutexLock lock(mutex_);
  asked_ = kNoDevice;
  Add({.at = now.wall}, text);
}

bool LineRecorder::IsQuotable(Now now) const {
  return !last_secret_ || now.instant - *last_secret_ > kNoReasons;
}

LineRecorder::Exchange& LineRecorder::Begin() {
  newest_ = (newest_ + 1) % kExchanges;
  count_ = std::min(count_ + 1, kExchanges);
  ring_[newest_].Clear();
  return ring_[newest_];
}

void LineRecorder::BeginUnasked(Now now) {
  const auto last = std::exchange(received_, now.instant);
  const bool asks = asked_ != kNoDevice || (ended_ && now.instant - *ended_ < kOnlyListens);
  if (count_ == 0 || asks) return;
  const bool silent = !last || now.instant - *last >= kSilence;
  if (silent || ring_[newest_].on_wire >= kMostBytes) Begin();
}

void LineRecorder::Add(const Item& item, std::string_view text) {
  const View content(reinterpret_cast<const std::uint8_t*>(text.data()),
                     std::min(text.size(), kMostText));
  if (!readers_.empty()) Tell(Show(item, content, {}));
  // The number of notes is limited, because a line without exchanges never begins a new exchange.
  Exchange& exchange = Current();
  if (exchange.items.size() < kMostItems + kMostNotes) exchange.Keep(item, content);
}

void LineRecorder::AddBytes(const Item& item, View bytes, const std::vector<bool>& masked) {
  if (!readers_.empty()) Tell(Show(item, bytes, masked));
  Exchange& exchange = Current();
  const View kept = bytes.first(std::min(bytes.size(), kMostBytes - exchange.on_wire));
  exchange.left_out += bytes.size() - kept.size();
  if (kept.empty()) return;
  const std::size_t begin = exchange.bytes.size();
  exchange.on_wire += kept.size();
  exchange.Keep(item, kept);
  for (std::size_t i = 0; i < kept.size() && i < masked.size(); ++i) {
    if (!masked[i]) continue;
    exchange.masked.resize(exchange.bytes.size());
    exchange.masked[begin + i] = true;
    exchange.bytes[begin + i] = 0;
  }
}

TraceRecord LineRecorder::Show(const Item& item, View content,
                               const std::vector<bool>& masked) const {
  TraceRecord record;
  record.kind = item.kind;
  record.at = item.at;
  if (item.device != kNoDevice) record.device = NameOf(item.device);
  record.outcome = item.outcome;
  record.round_trip = item.round_trip;
  if (item.kind == TraceRecord::Kind::end || item.kind == TraceRecord::Kind::note) {
    record.text = AsText(content);
    return record;
  }
  for (std::size_t i = 0; i < content.size(); ++i) {
    const bool secret = i < masked.size() && masked[i];
    if (i > 0) record.hex += ' ';
    record.hex += secret ? "**" : HexByte(content[i]);
    record.text += secret ? '*' : Shown(content[i]);
  }
  return record;
}

std::vector<TraceRecord> LineRecorder::Copy() const {
  std::vector<TraceRecord> records;
  for (std::size_t i = 0; i < count_; ++i) {
    const Exchange& exchange = ring_[(newest_ + kExchanges - count_ + 1 + i) % kExchanges];
    for (const Item& item : exchange.items) {
      std::vector<bool> masked;
      for (std::size_t at = item.begin; at < item.end && at < exchange.masked.size(); ++at) {
        masked.push_back(exchange.masked[at]);
      }
      const View content = View(exchange.bytes).subspan(item.begin, item.end - item.begin);
      records.push_back(Show(item, content, masked));
    }
    if (exchange.left_out == 0) continue;
    TraceRecord note;
    note.at = exchange.items.back().at;
    note.text = "… " + std::to_string(exchange.left_out) + " more bytes";
    records.push_back(std::move(note));
  }
  return records;
}

std::optional<Recording> LineRecorder::Save(std::uint32_t device, const char* reason, Now now) {
  if (!sink_ || (saved_ && now.instant - *saved_ < kBetweenRecordings)) return std::nullopt;
  saved_ = now.instant;
  return Recording{line_.name, TraceHead(line_), NameOf(device), reason, now.wall, Copy()};
}

std::string LineRecorder::NameOf(std::uint32_t device) const {
  return device >= bus::kFirstSlave ? bus::SlaveName(device)
                                    : line_.devices[device - first_device_].name;
}

void LineRecorder::Tell(const TraceRecord& record) {
  std::erase_if(readers_, [&](const std::weak_ptr<TraceQueue>& reader) {
    const auto queue = reader.lock();
    if (queue) queue->Push(record);
    return !queue;
  });
}

std::shared_ptr<TraceQueue> LineRecorder::Subscribe(std::function<void()> wake) {
  auto queue = std::make_shared<TraceQueue>(std::move(wake));
  const MutexLock lock(mutex_);
  readers_.push_back(queue);
  return queue;
}

std::vector<TraceRecord> LineRecorder::Recorded() const {
  const MutexLock lock(mutex_);
  return Copy();
}

namespace {

namespace fs = std::filesystem;

constexpr std::string_view kEnding = ".trace";

/// Returns a time for file names. Example: "20261121T040506Z".
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

/// Replaces each character that could be special in a file name. Configured names contain no such
/// character today.
std::string Safe(std::string name) {
  for (char& c : name) {
    const bool plain = (c >= '0' && c <= '9') || (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z');
    if (!plain && c != '-' && c != '_') c = '_';
  }
  return name;
}

std::string FileName(const Recording& recording) {
  return Safe(recording.line) + "-" + StampOf(recording.at) + "-" + Safe(recording.name) + "-" +
         recording.reason + std::string(kEnding);
}

std::string Contents(const Recording& recording, const std::string& version,
                     const std::string& file) {
  std::string text = fmt::format(
      "# baudgate {}: the last exchanges of a line, saved at {}\n"
      "# reason: device {}, {}\n"
      "# to decode them, run: baudgate decode --device {} {}\n"
      "# time (UTC), device, > sent, < received, = outcome and round trip, # note; ** is secret\n",
      version, FormatWallTime(recording.at), recording.name, recording.reason, recording.name,
      file);
  for (const std::string& line : recording.head) text += line + "\n";
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
    Write({Safe(recording->line), name, Contents(*recording, version_, name)});
  }
}

void Recordings::Write(const File& file) {
  std::error_code error;
  fs::create_directories(folder_, error);
  // Each line has one temporary file name, so a file that a crash has left is overwritten by the
  // next write.
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
      fmt::format("recordings: cannot write to {}: {}; traces of failures are not saved until the "
                  "folder can be written",
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
  // The names are sorted by time, because the time follows the line's name.
  std::sort(names.begin(), names.end());
  names.resize(names.size() - kFilesPerLine);
  for (const std::string& name : names) fs::remove(folder_ / name, error);
}

}  // namespace baudgate::records
