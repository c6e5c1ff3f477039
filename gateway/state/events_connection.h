// One writing connection to events.db over all that happens to the file: it is opened when it is
// needed, found damaged and put aside, removed behind our back. On one thread; its owner has its
// own tables and statements, which end before the connection does.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>

#include "gateway/state/events_file.h"
#include "gateway/state/file_turn.h"
#include "gateway/state/open_file.h"

namespace baudgate {

class EventsConnection {
 public:
  /// `vfs`: as in Database. `turn`: of all connections to this file; null: there is no other.
  explicit EventsConnection(std::filesystem::path path, std::string vfs = {},
                            std::shared_ptr<FileTurn> turn = {});

  struct Opened {
    bool ok = false;
    std::string error{};
    std::string put_aside{};  ///< see OpenedEvents
    std::optional<std::string> lost{};
    bool new_file = false;  ///< rows that were written before are not in it
  };
  /// Not open. With the turn.
  Opened Open();
  /// The last statement has failed: what to say of it. A damaged file is closed; whoever opens it
  /// next puts it aside. With the turn.
  Error Failed();
  /// The file that is open has been removed or replaced: closed, and an error. With the turn.
  Status CheckThere();
  void Close() { database_.reset(); }

  bool is_open() const { return database_ != nullptr; }
  Database& database() { return *database_; }
  FileTurn& turn() { return *turn_; }
  const std::filesystem::path& path() const { return path_; }

 private:
  const std::filesystem::path path_;
  const std::string vfs_;
  const std::shared_ptr<FileTurn> turn_;
  std::unique_ptr<Database> database_;
  std::uint64_t file_ = 0;  ///< FileTurn::file of the one that was opened last
  bool damaged_ = false;    ///< that one
  OpenFile open_;
  bool gone_ = false;  ///< the last one that was open
};

}  // namespace baudgate
