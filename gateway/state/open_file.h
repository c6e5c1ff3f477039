// A database that somebody holds open, and whether it is still the one under its name: who removes
// or replaces it, or its log, takes all that is written to it from then on, and no write fails.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>

#include "gateway/state/database.h"

namespace baudgate {

class OpenFile {
 public:
  OpenFile() = default;
  /// As it is now. `vfs`: as in Database; with one it is always there.
  OpenFile(std::filesystem::path path, const std::string& vfs);

  enum class Found : std::uint8_t {
    there,
    log_gone,  ///< what it held is in the file now
    gone,      ///< closing `database` leaves alone what has its name by now
  };
  /// From time to time; `database` is open on it.
  Found Look(Database& database);
  /// Of log_gone, for users.
  static std::string LogGone();

 private:
  std::uint64_t Inode(const char* part = "") const;
  void RemoveOwn(const char* part, std::uint64_t inode) const;

  std::filesystem::path path_;
  std::uint64_t inode_ = 0;  // 0: it is no file of the system's
  // Of the log and its index; 0: they have not been seen yet.
  std::uint64_t log_ = 0;
  std::uint64_t index_ = 0;
};

}  // namespace baudgate
