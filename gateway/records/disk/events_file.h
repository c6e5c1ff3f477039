// events.db in the state folder: the file of what has to be known for ever, audit and events alike.
// Every commit is on the disk before it returns (WAL, synchronous=FULL). docs/audit.md and
// docs/events.md have its tables. EventsWriter is the one thread that writes, and EventsConnection
// is a writing connection that copes with all that happens to the file.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <string>

#include "gateway/base/worker.h"
#include "gateway/records/disk/database_file.h"

namespace baudgate::records {

// The one thread that writes events.db. The audit and the events have a connection each, and their
// workers take turns on this thread: SQLite never tells one of them that the file is busy, and the
// audit waits for one commit of the events at most, however many events are queued.
struct EventsWriter {
  /// What must be so before the file is opened: its folder is there, and ours. Empty: nothing.
  std::function<Status()> ready;
  // Used by the thread only:
  std::uint64_t times_put_aside = 0;  ///< the file
  std::size_t open = 0;               ///< connections
  /// All connections have to be closed before one is opened: they share an index of the log that is
  /// wrong.
  struct Closing {
    std::string why{};
    bool lost = false;  ///< records that were in the log
  };
  std::optional<Closing> closing{};
  WorkThread thread{"events.db"};
};

/// Written into the file, so that it is not taken for another program's: "BGev".
inline constexpr std::int64_t kEventsApplication = 0x42476576;
/// The version of the tables; one more for each change of them.
inline constexpr std::int64_t kEventsVersion = 1;

using OpenedEvents = OpenedDatabase;

/// As OpenDatabase.
OpenedEvents OpenEvents(const std::filesystem::path& file, const std::string& vfs = {},
                        const std::string& damage = {});

// One writing connection to events.db over all that happens to the file: it is opened when it is
// needed, found damaged and put aside, removed by somebody else. On one thread; its owner has its
// own tables and statements, which end before the connection does.
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

}  // namespace baudgate::records
