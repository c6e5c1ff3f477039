// A database that somebody holds open, and whether the disk still has it: nothing fails at first
// when its file or its log is removed, replaced, shortened or damaged. SQLite has pages in memory,
// and what it commits from then on is lost, or damages the rest.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>

#include "gateway/records/disk/database.h"

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
  /// Which file it is. Inode 0: there is none, or nobody knows; errno says which.
  struct Id {
    std::uint64_t device = 0;
    std::uint64_t inode = 0;
    bool operator==(const Id&) const = default;
  };

  Id IdOf(const char* part = "") const;
  void RemoveOwn(const char* part, const Id& id) const;
  std::string HeadTrouble(const Database& database);
  Look LookAtLog(Database& database) const;

  std::filesystem::path path_;
  Id id_;  // inode 0: it is no file of the system's
  // The log and its index; inode 0: they have not been seen yet.
  Id log_;
  Id index_;
  std::uint64_t longest_ = 0;  // that it was seen
  Bytes head_;
  std::int64_t application_ = 0;
};

}  // namespace baudgate
