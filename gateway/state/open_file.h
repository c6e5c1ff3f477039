// A file that somebody holds open, and whether it is still the one under its name: who removes or
// replaces it takes all that is written to it from then on, and no write fails.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>

namespace baudgate {

class OpenFile {
 public:
  OpenFile() = default;
  /// As it is now. `vfs`: as in Database; with one it is always there.
  OpenFile(std::filesystem::path path, const std::string& vfs);

  bool there() const { return inode_ == 0 || Inode() == inode_; }

 private:
  std::uint64_t Inode() const;

  std::filesystem::path path_;
  std::uint64_t inode_ = 0;  // 0: it is no file of the system's
};

}  // namespace baudgate
