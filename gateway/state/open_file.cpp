// SPDX-License-Identifier: Apache-2.0
#include "gateway/state/open_file.h"

#include <sys/stat.h>
#include <unistd.h>

#include <utility>

namespace baudgate {
namespace {

constexpr const char* kLog = "-wal";
constexpr const char* kIndex = "-shm";

}  // namespace

OpenFile::OpenFile(std::filesystem::path path, const std::string& vfs) : path_(std::move(path)) {
  if (vfs.empty()) inode_ = Inode();
}

std::uint64_t OpenFile::Inode(const char* part) const {
  struct stat found {};
  return ::stat((path_.string() + part).c_str(), &found) == 0 ? found.st_ino : 0;
}

void OpenFile::RemoveOwn(const char* part, std::uint64_t inode) const {
  if (inode != 0 && Inode(part) == inode) ::unlink((path_.string() + part).c_str());
}

OpenFile::Found OpenFile::Look(Database& database) {
  if (inode_ == 0) return Found::there;
  if (Inode() != inode_) {
    // The log of the old file would be played over the new one.
    database.Abandon();
    RemoveOwn(kLog, log_);
    RemoveOwn(kIndex, index_);
    return Found::gone;
  }
  const std::uint64_t log = Inode(kLog);
  if (log_ == 0) log_ = log;
  if (index_ == 0) index_ = Inode(kIndex);
  if (log == log_) return Found::there;
  // The open log has no name, and still holds what was committed. One that took its name is
  // another database's.
  database.EmptyLog();
  RemoveOwn(kLog, log);
  return Found::log_gone;
}

std::string OpenFile::LogGone() {
  return "its write-ahead log (-wal) was removed or replaced while it was in use; nothing is lost: "
         "what the log held was written to the file. Stop the gateway before you touch its files";
}

}  // namespace baudgate
