// SPDX-License-Identifier: Apache-2.0
#include "gateway/records/disk/file_health.h"

#include <fmt/format.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstdint>
#include <fstream>
#include <string_view>
#include <system_error>

#include "gateway/base/user_name.h"

namespace baudgate {
namespace {

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

/// Reads up to `bytes.size()`; how many there were.
std::size_t ReadSome(std::istream& in, Bytes& bytes) {
  in.read(reinterpret_cast<char*>(bytes.data()), static_cast<std::streamsize>(bytes.size()));
  return static_cast<std::size_t>(in.gcount());
}

/// How a write-ahead log begins.
constexpr std::uint32_t kLogMagic =
    0x377F0682;  // and that plus 1: the words of sums are big-endian
constexpr std::size_t kLogHead = 32;
constexpr std::size_t kFrameHead = 24;

/// The running sum of a log: two words, over pairs of words.
class LogSum {
 public:
  explicit LogSum(bool big) : big_(big) {}
  void Add(const std::uint8_t* bytes, std::size_t count) {
    for (std::size_t i = 0; i + 8 <= count; i += 8) {
      first_ += Word(bytes + i) + second_;
      second_ += Word(bytes + i + 4) + first_;
    }
  }
  /// As it stands in the file, where words are always big-endian.
  bool Is(const std::uint8_t* at) const { return Big(at) == first_ && Big(at + 4) == second_; }

 private:
  std::uint32_t Word(const std::uint8_t* at) const { return big_ ? Big(at) : Little(at); }

  bool big_;
  std::uint32_t first_ = 0;
  std::uint32_t second_ = 0;
};

}  // namespace

std::optional<std::string> WhyNoFile(const fs::path& file) {
  for (const char* part : {"", "-wal", "-shm"}) {
    std::error_code none;
    const std::string path = file.string() + part;
    const auto type = fs::status(path, none).type();
    if (none || type == fs::file_type::not_found || type == fs::file_type::regular) continue;
    return fmt::format("{} is {}, and no regular file: remove it", path,
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
      return fmt::format("permission denied: user {} may not enter its folder",
                         NameOfUser(::geteuid()));
    }
    const std::string user = NameOfUser(::geteuid());
    return fmt::format(
        "permission denied: {} belongs to user {} and has mode {:04o}: sudo chown {} {} && sudo "
        "chmod u+rw {}",
        path, NameOfUser(found.st_uid), found.st_mode & 07777U, user, path, path);
  }
  return std::nullopt;
}

std::string WhyReadOnly(const fs::path& file) {
  struct stat found {};
  if (::stat(file.c_str(), &found) != 0 || ::access(file.c_str(), W_OK) == 0) {
    return "it cannot be written";
  }
  if (errno == EROFS) return "its file system is mounted read-only";
  return fmt::format("it belongs to user {} and cannot be written by user {}: sudo chown {} {}",
                     NameOfUser(found.st_uid), NameOfUser(::geteuid()), NameOfUser(::geteuid()),
                     file.string());
}

std::optional<std::string> HeadDamage(View head) {
  const auto damage = [](const char* what) {
    return std::optional<std::string>(fmt::format("its head is damaged: {}", what));
  };
  if (head.size() < kDatabaseHead) return damage("it ends there");
  if (AsText(head.first(kFileMagic.size())) != kFileMagic) {
    return damage("it is no SQLite database");
  }
  const std::uint32_t page = std::uint32_t{head[16]} << 8U | head[17];
  if (page != 1 && !IsPageSize(page)) return damage("the size of its pages");  // 1: 65536
  for (const std::size_t at : {18U, 19U}) {
    if (head[at] != 1 && head[at] != 2) return damage("the version of its format");
  }
  if (head[21] != 64 || head[22] != 32 || head[23] != 32) return damage("its payload fractions");
  if (Big(&head[44]) > 4) return damage("the format of its schema");
  if (Big(&head[56]) > 3) return damage("its text encoding");
  return std::nullopt;
}

namespace {

/// Committed changes of the log that SQLite does not reach, because a frame before them is broken.
/// `in` stands behind the head.
std::size_t LostCommits(std::ifstream& in, const Bytes& head, std::uint32_t page, LogSum sum) {
  Bytes frame(kFrameHead + page);
  const auto same_salts = [&] {
    return std::equal(frame.begin() + 8, frame.begin() + 16, head.begin() + 16);
  };
  bool broken = false;
  std::size_t commits = 0;
  bool behind_a_commit = false;  // the last of these commits has a frame behind it
  while (ReadSome(in, frame) == frame.size()) {
    if (!broken) {
      sum.Add(frame.data(), 8);
      sum.Add(&frame[kFrameHead], page);
      broken = !same_salts() || !sum.Is(&frame[16]);
    }
    // Other salts: a frame of the log's last round, which a checkpoint has left behind.
    if (!broken || !same_salts()) continue;
    behind_a_commit = behind_a_commit || commits > 0;
    commits += Big(&frame[4]) != 0 ? 1 : 0;
  }
  // The one transaction that was being written when the power failed may be torn.
  return commits == 1 && !behind_a_commit ? 0 : commits;
}

}  // namespace

std::optional<std::string> LogDamage(const fs::path& file) {
  std::ifstream in(file.string() + "-wal", std::ios::binary);
  Bytes head(kLogHead);
  if (!in || ReadSome(in, head) < kLogHead) return std::nullopt;  // none, or it was never used
  const std::uint32_t magic = Big(head.data());
  const std::uint32_t page = Big(&head[8]);
  LogSum sum(magic == kLogMagic + 1);
  sum.Add(head.data(), 24);
  const bool head_good =
      (magic == kLogMagic || magic == kLogMagic + 1) && IsPageSize(page) && sum.Is(&head[24]);
  if (!head_good) {
    // SQLite writes and syncs the head before the first frame.
    Bytes frame(kFrameHead + (IsPageSize(page) ? page : 4096));
    const bool any = ReadSome(in, frame) == frame.size();
    return any ? std::optional<std::string>(
                     "the head of its log is damaged: all changes in the "
                     "log are lost")
               : std::nullopt;
  }
  const std::size_t commits = LostCommits(in, head, page, sum);
  if (commits == 0) return std::nullopt;
  // Another connection may have begun a new round meanwhile.
  Bytes now(kLogHead);
  in.clear();
  in.seekg(0);
  if (ReadSome(in, now) != kLogHead || now != head) return std::nullopt;
  return fmt::format("its log is damaged: {} committed changes behind the damage are lost",
                     commits);
}

}  // namespace baudgate
