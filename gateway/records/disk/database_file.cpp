// SPDX-License-Identifier: Apache-2.0
#include "gateway/records/disk/database_file.h"

#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstddef>
#include <cstring>
#include <fstream>
#include <system_error>
#include <utility>

#include "gateway/base/system_trouble.h"

namespace baudgate::records {
namespace {

constexpr std::size_t kDatabaseHead = 100;
namespace fs = std::filesystem;

constexpr std::string_view kFileMagic{"SQLite format 3\0", 16};

bool IsPageSize(std::uint32_t size) {
  return size >= 512 && size <= 65536 && (size & (size - 1)) == 0;
}

std::uint32_t Big(const std::uint8_t* at) {
  return std::uint32_t{at[0]} << 24U | std::uint32_t{at[1]} << 16U | std::uint32_t{at[2]} << 8U |
         at[3];
}

std::uint32_t Little(const std::uint8_t* at) {
  return std::uint32_t{at[3]} << 24U | std::uint32_t{at[2]} << 16U | std::uint32_t{at[1]} << 8U |
         at[0];
}

std::size_t ReadSome(std::istream& in, Bytes& bytes) {
  in.read(reinterpret_cast<char*>(bytes.data()), static_cast<std::streamsize>(bytes.size()));
  return static_cast<std::size_t>(in.gcount());
}

/// The first word of a write-ahead log whose checksums are over little-endian words. If the
/// checksums are over big-endian words, the first word is kLogMagic + 1.
constexpr std::uint32_t kLogMagic = 0x377F0682;
constexpr std::size_t kLogHead = 32;
constexpr std::size_t kFrameHead = 24;

/// Computes the running checksum of a write-ahead log: two sums over pairs of words.
class LogSum {
 public:
  explicit LogSum(bool big) : big_(big) {}
  void Add(const std::uint8_t* bytes, std::size_t count) {
    for (std::size_t i = 0; i + 8 <= count; i += 8) {
      first_ += Word(bytes + i) + second_;
      second_ += Word(bytes + i + 4) + first_;
    }
  }
  /// True if the checksum equals the 8 bytes at `at`. In the file, the words of a checksum are
  /// always big-endian.
  bool Is(const std::uint8_t* at) const { return Big(at) == first_ && Big(at + 4) == second_; }

 private:
  std::uint32_t Word(const std::uint8_t* at) const { return big_ ? Big(at) : Little(at); }

  bool big_;
  std::uint32_t first_ = 0;
  std::uint32_t second_ = 0;
};

/// Returns what is wrong with the first bytes of a database; empty: the bytes are valid. SQLite
/// would report some of these faults as "readonly" or "unsupported" only.
std::optional<std::string> HeadDamage(View head) {
  const auto damage = [](const char* what) {
    return std::optional<std::string>(fmt::format("its header is damaged: {}", what));
  };
  if (head.size() < kDatabaseHead) return damage("the file is too short");
  if (AsText(head.first(kFileMagic.size())) != kFileMagic) {
    return damage("the file is not a SQLite database");
  }
  const std::uint32_t page = std::uint32_t{head[16]} << 8U | head[17];
  if (page != 1 && !IsPageSize(page)) return damage("invalid page size");  // 1 stands for 65536
  for (const std::size_t at : {18U, 19U}) {
    if (head[at] != 1 && head[at] != 2) return damage("invalid format version");
  }
  if (head[21] != 64 || head[22] != 32 || head[23] != 32)
    return damage("invalid payload fractions");
  if (Big(&head[44]) > 4) return damage("invalid schema format");
  if (Big(&head[56]) > 3) return damage("invalid text encoding");
  return std::nullopt;
}

}  // namespace

std::optional<std::string> WhyNoFile(const fs::path& file) {
  for (const char* part : {"", "-wal", "-shm"}) {
    std::error_code none;
    const std::string path = file.string() + part;
    const auto type = fs::status(path, none).type();
    if (none || type == fs::file_type::not_found || type == fs::file_type::regular) continue;
    return fmt::format("{} is {}, not a regular file: remove it", path,
                       type == fs::file_type::fifo        ? "a FIFO"
                       : type == fs::file_type::directory ? "a folder"
                                                          : "a device or a socket");
  }
  return std::nullopt;
}

std::optional<std::string> WhyNoAccess(const fs::path& file) {
  struct stat found {};
  for (const char* part : {"", "-wal", "-shm"}) {
    const std::string path = file.string() + part;
    if (::access(path.c_str(), R_OK) == 0 || errno != EACCES) continue;
    if (::stat(path.c_str(), &found) != 0) {
      return fmt::format("permission denied: user {} cannot enter the folder of the file",
                         NameOfUser(::geteuid()));
    }
    const std::string user = NameOfUser(::geteuid());
    return fmt::format(
        "permission denied: {} belongs to user {} and has mode {:04o}; run: sudo chown {} {} && "
        "sudo chmod u+rw {}",
        path, NameOfUser(found.st_uid), found.st_mode & 07777U, user, path, path);
  }
  return std::nullopt;
}

std::string WhyReadOnly(const fs::path& file) {
  struct stat found {};
  if (::stat(file.c_str(), &found) != 0 || ::access(file.c_str(), W_OK) == 0) {
    return "the file cannot be written";
  }
  if (errno == EROFS) return "its file system is mounted read-only; check the disk (dmesg)";
  return fmt::format(
      "the file belongs to user {}, and user {} cannot write it; run: sudo chown {} {}",
      NameOfUser(found.st_uid), NameOfUser(::geteuid()), NameOfUser(::geteuid()), file.string());
}

namespace {

/// Returns the number of committed changes in the log that SQLite does not reach because a frame
/// before them is broken. `in` must be positioned behind the log's head; `head` contains the head.
std::size_t LostCommits(std::ifstream& in, const Bytes& head, std::uint32_t page, LogSum sum) {
  Bytes frame(kFrameHead + page);
  const auto same_salts = [&] {
    return std::equal(frame.begin() + 8, frame.begin() + 16, head.begin() + 16);
  };
  bool broken = false;
  std::size_t commits = 0;
  bool behind_a_commit = false;
  while (ReadSome(in, frame) == frame.size()) {
    if (!broken) {
      sum.Add(frame.data(), 8);
      sum.Add(&frame[kFrameHead], page);
      broken = !same_salts() || !sum.Is(&frame[16]);
    }
    // Frames with other salts are left over from before the last checkpoint, after which SQLite
    // writes the log from its beginning again.
    if (!broken || !same_salts()) continue;
    behind_a_commit = behind_a_commit || commits > 0;
    commits += Big(&frame[4]) != 0 ? 1 : 0;
  }
  // A single lost commit at the end of the log is not damage: it was being written when the power
  // failed.
  return commits == 1 && !behind_a_commit ? 0 : commits;
}

}  // namespace

std::optional<std::string> LogDamage(const fs::path& file) {
  std::ifstream in(file.string() + "-wal", std::ios::binary);
  Bytes head(kLogHead);
  if (!in || ReadSome(in, head) < kLogHead) return std::nullopt;
  const std::uint32_t magic = Big(head.data());
  const std::uint32_t page = Big(&head[8]);
  LogSum sum(magic == kLogMagic + 1);
  sum.Add(head.data(), 24);
  const bool head_good =
      (magic == kLogMagic || magic == kLogMagic + 1) && IsPageSize(page) && sum.Is(&head[24]);
  if (!head_good) {
    // SQLite writes and syncs the head before the first frame, so a damaged head without a frame
    // behind it loses nothing.
    Bytes frame(kFrameHead + (IsPageSize(page) ? page : 4096));
    const bool any = ReadSome(in, frame) == frame.size();
    return any ? std::optional<std::string>(
                     "the header of its write-ahead log (-wal) is damaged: all changes in the log "
                     "are lost")
               : std::nullopt;
  }
  const std::size_t commits = LostCommits(in, head, page, sum);
  if (commits == 0) return std::nullopt;
  // Another connection may have begun to write the log from its beginning again. Then the count is
  // not valid.
  Bytes now(kLogHead);
  in.clear();
  in.seekg(0);
  if (ReadSome(in, now) != kLogHead || now != head) return std::nullopt;
  return fmt::format(
      "its write-ahead log (-wal) is damaged: {} committed changes after the damage are lost",
      commits);
}

namespace {

constexpr const char* kLog = "-wal";
constexpr const char* kIndex = "-shm";
constexpr std::string_view kAdvice = "stop the gateway before you touch its files";

std::uint32_t Big(const Bytes& bytes, std::size_t at) {
  return ByteReader(bytes).U32Be(at).value_or(0);
}

/// The first bytes of the index of the write-ahead log, which all connections share:
/// https://www.sqlite.org/walformat.html, 2.
struct LogIndex {
  static constexpr std::size_t kSize = 100;
  static constexpr std::size_t kHead = 48;  // size of the head, of which the index has two copies
  static constexpr std::size_t kLogHead = 32;
  static constexpr std::size_t kFrameHead = 24;
  // The first word of the log file; its last bit is the byte order of the checksums.
  static constexpr std::uint32_t kMagic = 0x377F0683;

  explicit LogIndex(Bytes its_bytes) : bytes(std::move(its_bytes)) {}

  /// True if the log contains frames and the two copies of the index's head are equal. They differ
  /// while a connection changes the index.
  bool valid() const {
    return bytes.size() == kSize && bytes[12] == 1 && frames() > 0 &&
           std::equal(bytes.begin(), bytes.begin() + kHead, bytes.begin() + kHead);
  }
  std::uint32_t Word(std::size_t at) const {  // in the byte order of this machine
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
  // The number of the log's frames that were copied to the file.
  std::uint32_t in_the_file() const { return Word(96); }
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
  // If stat fails for a reason other than a missing file, it is unknown whether the file exists.
  // The open descriptors still work.
  if (id.inode == 0 && errno != ENOENT && errno != ENOTDIR) return {};
  if (id != id_) {
    // Closing the database would copy the log of the old file into the new file.
    database.Abandon();
    RemoveOwn(kLog, log_);
    RemoveOwn(kIndex, index_);
    return {Found::gone, id.inode == 0 ? "the file was removed, and its content is lost"
                                       : "the file was replaced by another file"};
  }
  if (std::string trouble = HeadTrouble(database); !trouble.empty()) {
    database.Abandon();
    return {Found::damaged, std::move(trouble)};
  }
  const Id log = IdOf(kLog);
  if (log_.inode == 0) log_ = log;
  if (index_.inode == 0) index_ = IdOf(kIndex);
  if (log == log_) return LookAtLog(database);
  // Another program has removed or renamed the log. SQLite still has it open, so its content is
  // written to the file now; if a reader prevents this, the next call tries again. A new log of the
  // same name belongs to another database.
  if (!database.EmptyLog()) return {};
  RemoveOwn(kLog, log);
  return {Found::stale,
          fmt::format("its write-ahead log (-wal) was removed or replaced while it was in use; "
                      "no data was lost: the content of the log was written to the file; {}",
                      kAdvice)};
}

/// Returns what is wrong with the first bytes of the open file; empty: the bytes are valid. Some of
/// these bytes never change; others are 0 until the log is first copied to the file.
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
    return "its header is damaged: another program has changed the header while the file was open";
  }
  const std::uint64_t page = Big(head, 14) & 0xFFFFU;
  const std::uint64_t whole = Big(head, kPages) * (page == 1 ? 65536 : page);
  // If a reader delays a checkpoint, the newest pages can be in the log only, although the number
  // of pages in the head counts them already. Only damage makes the file shorter.
  longest_ = std::max(longest_, *size);
  if (*size >= whole || *size >= longest_) return {};
  return fmt::format("the file was truncated while it was in use: {} of {} bytes are left", *size,
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
                        "no data was lost: the file already contains the content of the log; {}",
                        kAdvice)};
  }
  // A checkpoint would copy the rest of the log to the file and leave a mixture of old and new
  // pages. If a checkpoint has copied some frames already, the file is a mixture already.
  database.Abandon();
  if (index.in_the_file() > 0) {
    return {Found::damaged,
            "a part of its write-ahead log (-wal) is lost, but the rest is already in the file, so "
            "the file is damaged"};
  }
  return {Found::lost,
          fmt::format("its write-ahead log (-wal) was shortened or damaged while it was in use: "
                      "the newest records are lost, up to {} pages of the log; {}",
                      frames - good, kAdvice)};
}

namespace {

namespace fs = std::filesystem;

constexpr int kMostPutAside = 99;

enum class Look : std::uint8_t { fine, failed, damaged, newer };

bool Migrate(Database& database, const DatabaseKind& kind, std::int64_t version) {
  if (version == kind.version()) return true;
  if (!database.Execute("BEGIN IMMEDIATE")) return false;
  bool ok = true;
  for (auto step = static_cast<std::size_t>(version); ok && step < kind.migrations.size(); ++step) {
    ok = database.Execute(kind.migrations[step]);
  }
  ok = ok && database.Execute(fmt::format("PRAGMA application_id={}", kind.application)) &&
       database.Execute(fmt::format("PRAGMA user_version={}", kind.version())) &&
       database.Execute("COMMIT");
  if (!ok) database.Rollback();
  return ok;
}

Look Broken(const Database& database, std::string& why) {
  why = database.error();
  return database.damaged() ? Look::damaged : Look::failed;
}

std::optional<std::int64_t> WholeNumber(Database& database, const char* sql) {
  const Value value = database.First(sql);
  return std::holds_alternative<std::int64_t>(value) ? std::optional(std::get<std::int64_t>(value))
                                                     : std::nullopt;
}

/// Checks that the file has the id `kind.application` and a known version, and migrates its tables.
/// `check`: the result of SQLite's quick_check.
Look LookAtVersion(Database& database, const DatabaseKind& kind, const std::string& check,
                   std::string& why) {
  const auto application = WholeNumber(database, "PRAGMA application_id");
  const auto version = WholeNumber(database, "PRAGMA user_version");
  const auto tables = WholeNumber(database, "SELECT count(*) FROM sqlite_schema");
  if (!application || !version || !tables) return Broken(database, why);
  if (check != "ok") {
    why = check;
    return Look::damaged;
  }
  const bool fresh = application == 0 && version == 0 && tables == 0;
  if (!fresh && application != kind.application) {
    why = "the file belongs to another program";
    return Look::damaged;
  }
  if (version < 0) {
    why = fmt::format("its version {} is invalid", *version);
    return Look::damaged;
  }
  if (version > kind.version()) {
    why = fmt::format(
        "a newer baudgate has written the file (version {}; this baudgate reads up to {}). Start "
        "the newer baudgate, or move the file away",
        *version, kind.version());
    return Look::newer;
  }
  return Migrate(database, kind, *version) ? Look::fine : Broken(database, why);
}

Look LookAt(Database& database, const DatabaseKind& kind, bool head, std::string& why) {
  const auto bytes = head ? database.Read(Database::Part::file, 0, kDatabaseHead) : std::nullopt;
  if (const auto damage = bytes ? HeadDamage(*bytes) : std::nullopt) {
    why = *damage;
    return Look::damaged;
  }
  // WAL mode is stored in the file. If SQLite is recovering the file, this statement waits.
  const Value mode = database.First("PRAGMA journal_mode=WAL");
  if (!HasValue(mode)) return Broken(database, why);
  if (baudgate::ToText(mode) != "wal") {
    why = "the folder of the file cannot be written";
    return Look::failed;
  }
  if (!database.Execute(std::string(kind.pragmas))) return Broken(database, why);
  const Value check = database.First("PRAGMA quick_check(1)");
  if (!HasValue(check)) return Broken(database, why);
  return LookAtVersion(database, kind, baudgate::ToText(check), why);
}

/// Renames the file together with its log and index. Returns the new name; empty: the file cannot
/// be renamed.
fs::path PutAside(const fs::path& file) {
  fs::path to;
  std::error_code error;
  for (int n = 1; n <= kMostPutAside; ++n) {
    to = file.string() + ".bad" + (n == 1 ? "" : std::to_string(n));
    if (!fs::exists(to, error)) break;
  }
  fs::rename(file, to, error);
  if (error) return {};
  for (const char* part : {"-wal", "-shm"}) {
    fs::rename(file.string() + part, to.string() + part, error);
  }
  return to;
}

std::string RenamedText(const fs::path& file, const std::string& why, const fs::path& to) {
  return fmt::format("{} is damaged ({}); it was renamed to {} and a new file was created",
                     file.string(), why, to.filename().string());
}

/// True for an empty file. A file system can leave an empty file after a power cut; a database of
/// the gateway is never empty once it was opened.
bool IsEmpty(const fs::path& file) {
  std::error_code none;
  return fs::is_regular_file(file, none) && fs::file_size(file, none) == 0;
}

}  // namespace

OpenedDatabase OpenDatabase(const fs::path& file, const DatabaseKind& kind, const std::string& vfs,
                            const std::string& damage) {
  OpenedDatabase opened;
  std::error_code none;
  if (vfs.empty()) {
    if (auto why = WhyNoFile(file)) {
      opened.error = *std::move(why);
      return opened;
    }
  }
  if (!damage.empty() && fs::exists(file, none)) {
    const fs::path to = PutAside(file);
    if (to.empty()) {
      opened.error = file.string() + " is damaged and cannot be renamed; move it away";
      return opened;
    }
    opened.put_aside = RenamedText(file, damage, to);
  }
  for (int tries = 0; tries < 2; ++tries) {
    const bool was_there = !vfs.empty() || fs::exists(file, none);
    std::unique_ptr<Database> database;
    std::string why = "the file is empty: its content is lost";
    Look look = Look::damaged;
    if (!vfs.empty() || !IsEmpty(file)) {
      if (vfs.empty()) opened.lost = LogDamage(file);
      database = std::make_unique<Database>(file.string(), Database::Mode::write, vfs);
      why = database->error();
      look = database->is_open() ? LookAt(*database, kind, vfs.empty() && was_there, why)
                                 : Look::failed;
    }
    if (look == Look::fine) {
      opened.database = std::move(database);
      if (opened.lost) *opened.lost = file.string() + ": " + *opened.lost;
      return opened;
    }
    opened.error = fmt::format("{}: {}", file.string(), why);
    database.reset();
    // On a full disk the file was made but not written. It is removed, so that the next start does
    // not take it for a lost database.
    if (!was_there && IsEmpty(file)) fs::remove(file, none);
    if (look != Look::damaged) return opened;
    const fs::path to = PutAside(file);
    if (to.empty()) return opened;
    opened.put_aside = RenamedText(file, why, to);
  }
  return opened;
}

std::vector<std::string> PutAsideOf(const fs::path& file) {
  const std::string begin = file.filename().string() + ".bad";
  std::vector<std::string> names;
  std::error_code error;
  for (fs::directory_iterator one(file.parent_path(), error), end; !error && one != end;
       one.increment(error)) {
    std::string name = one->path().filename().string();
    const bool part = name.ends_with("-wal") || name.ends_with("-shm");
    if (name.starts_with(begin) && !part) names.push_back(std::move(name));
  }
  std::ranges::sort(names);
  return names;
}

}  // namespace baudgate::records
