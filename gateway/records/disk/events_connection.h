// One writing connection to events.db over all that happens to the file: it is opened when it is
// needed, found damaged and put aside, removed by somebody else. On one thread; its owner has its
// own tables and statements, which end before the connection does.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>

#include "gateway/records/disk/events_file.h"
#include "gateway/records/disk/events_writer.h"
#include "gateway/records/disk/open_file.h"

namespace baudgate {

class EventsConnection {
 public:
  /// `vfs`: as in Database. `writer`: all connections to this file share it; null: there is no
  /// other connection.
  explicit EventsConnection(std::filesystem::path path, std::string vfs = {},
                            std::shared_ptr<EventsWriter> writer = {});
  ~EventsConnection() { Close(); }
  EventsConnection(const EventsConnection&) = delete;
  EventsConnection& operator=(const EventsConnection&) = delete;

  struct Opened {
    bool ok = false;
    std::string error{};
    std::string put_aside{};  ///< see OpenedEvents
    std::optional<std::string> lost{};
    bool new_file = false;  ///< rows that were written before are not in it
  };
  /// Not open.
  Opened Open();
  /// The last statement has failed: what to say of it. A damaged file is closed; whoever opens it
  /// next puts it aside.
  Error Failed();
  /// From time to time, and before each commit: the disk has what is open. Else it is closed, and
  /// an error. `whole`: all of the file is read, for a reader has found damage.
  Status Check(bool whole = false);
  void Close();

  bool is_open() const { return database_ != nullptr; }
  Database& database() { return *database_; }
  const std::filesystem::path& path() const { return path_; }

 private:
  Status Leave(std::string why, bool lost);

  const std::filesystem::path path_;
  const std::string vfs_;
  const std::shared_ptr<EventsWriter> writer_;
  std::unique_ptr<Database> database_;
  std::uint64_t times_put_aside_ = 0;  ///< when this connection was opened last
  std::string damage_;                 ///< of the file that was open then; empty: it was whole
  OpenFile open_;
  bool gone_ = false;  ///< the last one that was open, or records in it
};

}  // namespace baudgate
