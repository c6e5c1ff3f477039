// A database that somebody holds open, and whether the disk still has it: nothing fails at first
// when its file or its log is removed, replaced, shortened or damaged. SQLite has pages in memory,
// and what it commits from then on is lost, or damages the rest.
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
  /// As it is now. `vfs`: as in Database; with one all is well always.
  OpenFile(std::filesystem::path path, const std::string& vfs, Database& database);

  enum class Found : std::uint8_t {
    whole,
    stale,    ///< the log; what it held is in the file now. To be opened again
    lost,     ///< a part of the log; the file has what came before. To be opened again
    gone,     ///< the file. To be opened again; what has its name by now is left alone
    damaged,  ///< the file. To be put aside
  };
  struct Look {
    Found found = Found::whole;
    std::string why{};  ///< for users; empty: it is whole
  };
  /// From time to time, and before each commit. `database` is open on it. A few reads: what is
  /// damaged inside its pages is not seen.
  Look LookAt(Database& database);

 private:
  std::uint64_t Inode(const char* part = "") const;
  void RemoveOwn(const char* part, std::uint64_t inode) const;
  std::string HeadTrouble(const Database& database) const;
  Look LookAtLog(Database& database) const;

  std::filesystem::path path_;
  std::uint64_t inode_ = 0;  // 0: it is no file of the system's
  // Of the log and its index; 0: they have not been seen yet.
  std::uint64_t log_ = 0;
  std::uint64_t index_ = 0;
  Bytes head_;
  std::int64_t application_ = 0;
};

}  // namespace baudgate
