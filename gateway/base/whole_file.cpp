// SPDX-License-Identifier: Apache-2.0
#include "gateway/base/whole_file.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <array>
#include <cerrno>
#include <cstddef>
#include <utility>

namespace baudgate {
namespace {

constexpr std::size_t kLargestWhole = std::size_t{32} << 20U;

/// Makes a rename or removal in the folder of `file` survive a power failure. Ignores errors.
void SyncFolderOf(const std::filesystem::path& file) {
  const std::filesystem::path parent = file.has_parent_path() ? file.parent_path() : ".";
  const int folder = ::open(parent.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  if (folder < 0) return;
  ::fsync(folder);
  ::close(folder);
}

}  // namespace

int WriteWhole(const std::filesystem::path& file, std::string_view text) {
  const std::filesystem::path part = file.string() + ".part";
  // A file of this name is removed first: a FIFO would block the open, and a link can lead to any
  // file.
  if (::unlink(part.c_str()) != 0 && errno != ENOENT) return errno;
  const int out = ::open(part.c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0640);
  if (out < 0) return errno;
  struct stat before {};
  if (::stat(file.c_str(), &before) == 0) (void)!::fchown(out, before.st_uid, before.st_gid);
  int error = ::fchmod(out, 0640) == 0 ? 0 : errno;
  while (!text.empty() && error == 0) {
    const auto written = ::write(out, text.data(), text.size());
    if (written > 0) text.remove_prefix(static_cast<std::size_t>(written));
    if (written < 0 && errno != EINTR) error = errno;
  }
  if (error == 0 && ::fsync(out) != 0) error = errno;
  if (::close(out) != 0 && error == 0) error = errno;
  if (error == 0) error = MoveFile(part, file);
  if (error != 0) ::unlink(part.c_str());
  return error;
}

int MoveFile(const std::filesystem::path& from, const std::filesystem::path& to) {
  if (::rename(from.c_str(), to.c_str()) != 0) return errno;
  SyncFolderOf(to);
  return 0;
}

int RemoveFile(const std::filesystem::path& file) {
  if (::unlink(file.c_str()) != 0) return errno == ENOENT ? 0 : errno;
  SyncFolderOf(file);
  return 0;
}

std::optional<std::string> ReadWhole(const std::filesystem::path& file, Kind kind) {
  // Without O_NONBLOCK the open of a FIFO blocks until a program opens it for writing.
  const int wait = kind == Kind::any ? 0 : O_NONBLOCK;
  const int in = ::open(file.c_str(), O_RDONLY | O_CLOEXEC | wait);
  if (in < 0) return std::nullopt;
  struct stat found {};
  if (kind == Kind::regular && (::fstat(in, &found) != 0 || !S_ISREG(found.st_mode))) {
    ::close(in);
    errno = S_ISDIR(found.st_mode) ? EISDIR : EINVAL;
    return std::nullopt;
  }
  std::string text;
  std::array<char, 16384> part;
  int error = 0;
  for (ssize_t got = 1; got != 0 && error == 0;) {
    got = ::read(in, part.data(), part.size());
    if (got > 0) text.append(part.data(), static_cast<std::size_t>(got));
    if (got < 0 && errno != EINTR) error = errno;
    if (text.size() > kLargestWhole) error = EFBIG;
  }
  ::close(in);
  errno = error;
  return error == 0 ? std::optional(std::move(text)) : std::nullopt;
}

}  // namespace baudgate
