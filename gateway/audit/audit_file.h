// The audit's side of events.db: opens it when it is needed, writes what the book has due, and says
// what went wrong. On one thread (gateway/audit/audit_log.h), without a clock of its own.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "gateway/audit/write_table.h"
#include "gateway/state/events_file.h"

namespace baudgate::audit {

class AuditFile {
 public:
  /// `vfs`: as in Database.
  explicit AuditFile(std::filesystem::path path, std::string vfs = {},
                     const std::array<Room, kKinds>& rooms = kRooms);

  struct Opened {
    bool ok = false;
    std::string error{};
    std::string put_aside{};  ///< see OpenedEvents
    bool new_file = false;    ///< rows that were written before are not in it
  };
  /// Nothing where it is open and fit for use.
  std::optional<Opened> Open();
  /// Open; all of them are on the disk, with their seq, or none is.
  Status Write(std::vector<Draft>& drafts);
  /// Takes out what there is no room for, and what is too old. Its failures are the next write's.
  void Tidy(Now now);

  bool is_open() const { return table_.has_value(); }
  const std::filesystem::path& path() const { return path_; }

 private:
  Error Failed();
  /// The file that is open has been removed or replaced.
  bool IsGone() const;
  std::uint64_t Inode() const;

  const std::filesystem::path path_;
  const std::string vfs_;
  const std::array<Room, kKinds> rooms_;
  std::unique_ptr<Database> database_;
  std::optional<WriteTable> table_;
  bool damaged_ = false;
  std::uint64_t inode_ = 0;  ///< of the file that is open; 0: it is no file of the system's
  bool gone_ = false;        ///< the last one that was open
  std::optional<Instant> drop_old_at_;
};

}  // namespace baudgate::audit
