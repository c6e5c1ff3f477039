// SPDX-License-Identifier: Apache-2.0
#include "gateway/records/disk/open_file.h"

#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <utility>

#include "gateway/records/disk/file_health.h"

namespace baudgate {
namespace {

constexpr const char* kLog = "-wal";
constexpr const char* kIndex = "-shm";
constexpr std::string_view kAdvice = "stop the gateway before you touch its files";

std::uint32_t Big(const Bytes& bytes, std::size_t at) {
  return ByteReader(bytes).U32Be(at).value_or(0);
}

/// What all connections know of the log: https://www.sqlite.org/walformat.html, 2.
struct LogIndex {
  static constexpr std::size_t kSize = 100;
  static constexpr std::size_t kHead = 48;  // it is there twice
  // The layout of the log.
  static constexpr std::size_t kLogHead = 32;
  static constexpr std::size_t kFrameHead = 24;
  static constexpr std::uint32_t kMagic = 0x377F0683;  // its last bit is the order of its words

  explicit LogIndex(Bytes its_bytes) : bytes(std::move(its_bytes)) {}

  /// A log is in use, and nobody changes it just now.
  bool valid() const {
    return bytes.size() == kSize && bytes[12] == 1 && frames() > 0 &&
           std::equal(bytes.begin(), bytes.begin() + kHead, bytes.begin() + kHead);
  }
  std::uint32_t Word(std::size_t at) const {  // in the order of this machine
    std::uint32_t word = 0;
    std::memcpy(&word, &bytes[at], sizeof(word));
    return word;
  }
  std::uint32_t page() const {
    std::uint16_t size = 0;
    std::memcpy(&size, &bytes[14], sizeof(size));
    return size == 1 ? 65536 : size;
  }
  std::uint32_t frames() const { return Word(16); }
  std::uint32_t in_the_file() const { return Word(96); }  // of the frames
  View salt() const { return View(bytes).subspan(32, 8); }

  Bytes bytes;
};

bool Has(const Bytes& bytes, std::size_t at, View part) {
  return bytes.size() >= at + part.size() &&
         std::equal(part.begin(), part.end(), bytes.begin() + static_cast<std::ptrdiff_t>(at));
}

}  // namespace

OpenFile::OpenFile(std::filesystem::path path, const std::string& vfs, Database& database)
    : path_(std::move(path)) {
  if (!vfs.empty()) return;
  id_ = IdOf();
  longest_ = database.SizeOf(Database::Part::file).value_or(0);
  head_ = database.Read(Database::Part::file, 0, kDatabaseHead).value_or(Bytes());
  const Value application = database.First("PRAGMA application_id");
  if (const auto* number = std::get_if<std::int64_t>(&application)) application_ = *number;
}

OpenFile::Id OpenFile::IdOf(const char* part) const {
  struct stat found {};
  if (::stat((path_.string() + part).c_str(), &found) != 0) return {};
  return {found.st_dev, found.st_ino};
}

void OpenFile::RemoveOwn(const char* part, const Id& id) const {
  if (id.inode != 0 && IdOf(part) == id) ::unlink((path_.string() + part).c_str());
}

OpenFile::Look OpenFile::LookAt(Database& database) {
  if (id_.inode == 0) return {};
  const Id id = IdOf();
  // The folder cannot be looked into: nobody knows. The open files still work.
  if (id.inode == 0 && errno != ENOENT && errno != ENOTDIR) return {};
  if (id != id_) {
    // The log of the old file would be played over the new one.
    database.Abandon();
    RemoveOwn(kLog, log_);
    RemoveOwn(kIndex, index_);
    return {Found::gone, id.inode == 0 ? "it was removed, and all that was in it"
                                       : "another file is in its place"};
  }
  if (std::string trouble = HeadTrouble(database); !trouble.empty()) {
    database.Abandon();
    return {Found::damaged, std::move(trouble)};
  }
  const Id log = IdOf(kLog);
  if (log_.inode == 0) log_ = log;
  if (index_.inode == 0) index_ = IdOf(kIndex);
  if (log == log_) return LookAtLog(database);
  // The open log has no name, and still holds what was committed. One that took its name is
  // another database's. While somebody reads it is tried again.
  if (!database.EmptyLog()) return {};
  RemoveOwn(kLog, log);
  return {Found::stale,
          fmt::format("its write-ahead log (-wal) was removed or replaced while it was in use; "
                      "nothing is lost: what the log held was written to the file; {}",
                      kAdvice)};
}

/// Some of it never changes, and some is 0 before the log has come to the file first.
std::string OpenFile::HeadTrouble(const Database& database) {
  constexpr std::size_t kFixed = 24;
  constexpr std::size_t kPages = 28;
  constexpr std::size_t kApplication = 68;
  const auto read = database.Read(Database::Part::file, 0, kDatabaseHead);
  const auto size = database.SizeOf(Database::Part::file);
  if (!read || !size || head_.size() < kDatabaseHead) return {};
  const Bytes& head = *read;
  if (auto damage = HeadDamage(head)) return *std::move(damage);
  const std::int64_t application = Big(head, kApplication);
  const bool foreign = application != 0 && application != application_;
  if (foreign || !std::equal(head.begin(), head.begin() + kFixed, head_.begin())) {
    return "its head is damaged: it is not what it was when it was opened";
  }
  const std::uint64_t page = Big(head, 14) & 0xFFFFU;
  const std::uint64_t whole = Big(head, kPages) * (page == 1 ? 65536 : page);
  // A checkpoint that a reader holds up leaves pages out: the newest may still be in the log alone,
  // while the head counts them already. Nothing but damage makes the file shorter.
  longest_ = std::max(longest_, *size);
  if (*size >= whole || *size >= longest_) return {};
  return fmt::format("it was shortened while it was in use: {} of {} bytes are there", *size,
                     whole);
}

OpenFile::Look OpenFile::LookAtLog(Database& database) const {
  const LogIndex index(database.ReadIndex(LogIndex::kSize));
  const auto size = database.SizeOf(Database::Part::log);
  const auto head = database.Read(Database::Part::log, 0, LogIndex::kLogHead);
  if (!index.valid() || !size || !head) return {};
  const std::uint32_t frames = index.frames();
  const std::uint64_t each = LogIndex::kFrameHead + index.page();
  std::uint64_t good = std::min<std::uint64_t>(frames, (*size - head->size()) / each);
  if (good == frames) {
    const auto last = database.Read(Database::Part::log, LogIndex::kLogHead + (frames - 1) * each,
                                    LogIndex::kFrameHead);
    if (!last) return {};
    if (!Has(*last, 8, index.salt()) || Big(*last, 16) != index.Word(24)) good = 0;
  }
  const bool sound = Has(*head, 16, index.salt()) && Big(*head, 8) == index.page() &&
                     (Big(*head, 0) | 1U) == LogIndex::kMagic;
  if (good == frames && sound) return {};
  if (good == frames || index.in_the_file() == frames) {
    if (!database.EmptyLog()) return {};
    return {Found::stale,
            fmt::format("its write-ahead log (-wal) was shortened or damaged while it was in use; "
                        "nothing is lost: the file has what the log held; {}",
                        kAdvice)};
  }
  // A checkpoint would bring what is left of it to the file, and leave a mixture. One that a reader
  // has held up in the middle has done so.
  database.Abandon();
  if (index.in_the_file() > 0) {
    return {Found::damaged,
            "a part of its write-ahead log (-wal) is lost, and another one is in the file already"};
  }
  return {Found::lost,
          fmt::format("its write-ahead log (-wal) was shortened or damaged while it was in use: "
                      "what was recorded last is lost, up to {} of its pages; {}",
                      frames - good, kAdvice)};
}

}  // namespace baudgate
