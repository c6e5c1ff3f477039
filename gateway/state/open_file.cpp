// SPDX-License-Identifier: Apache-2.0
#include "gateway/state/open_file.h"

#include <sys/stat.h>

#include <utility>

namespace baudgate {

OpenFile::OpenFile(std::filesystem::path path, const std::string& vfs) : path_(std::move(path)) {
  if (vfs.empty()) inode_ = Inode();
}

std::uint64_t OpenFile::Inode() const {
  struct stat found {};
  return ::stat(path_.c_str(), &found) == 0 ? found.st_ino : 0;
}

}  // namespace baudgate
