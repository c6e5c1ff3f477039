// `OpenEvents` opens events.db in the state folder, which contains the permanent records of audit
// and events. Every commit is on the disk before it returns (WAL, synchronous=FULL). docs/audit.md
// and docs/events.md describe the tables.
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

// `EventsWriter` is the only thread that writes events.db. The audit and the events have one
// connection each, and their workers take turns on this thread. So SQLite never reports that the
// file is busy, and the audit waits for one commit of the events at most, however many events are
// queued.
struct EventsWriter {
  /// Called before the file is opened. Returns an error if the folder does not exist or is not
  /// locked by this process. Can be empty.
  std::function<Status()> ready;
  // Only the writing thread uses the members below. `times_put_aside`: how often the file was put
  // aside; `open`: number of open connections.
  std::uint64_t times_put_aside = 0;
  std::size_t open = 0;
  /// The write-ahead log is damaged. The connections share an index of the log, which is wrong, so
  /// all must be closed before one is opened again.
  struct Closing {
    std::string why{};
    bool lost = false;
  };
  std::optional<Closing> closing{};
  WorkThread thread{"events.db"};
};

/// Written into the file, so that the gateway recognises it: "BGev".
inline constexpr std::int64_t kEventsApplication = 0x42476576;
/// The version of the tables; each change of the tables adds one.
inline constexpr std::int64_t kEventsVersion = 1;

using OpenedEvents = OpenedDatabase;

OpenedEvents OpenEvents(const std::filesystem::path& file, const std::string& vfs = {},
                        const std::string& damage = {});

// `EventsConnection` is one writing connection to events.db: it is opened when needed, and opened
// again after the file was damaged and put aside, or was removed. Used by one thread. The owner
// defines its tables and statements; the statements must be destroyed before the connection is
// closed.
class EventsConnection {
 public:
  /// `vfs`: the name of an SQLite VFS; empty: the default VFS. `writer` is shared by all
  /// connections to this file; null: this is the only connection.
  explicit EventsConnection(std::filesystem::path path, std::string vfs = {},
                            std::shared_ptr<EventsWriter> writer = {});
  ~EventsConnection() { Close(); }
  EventsConnection(const EventsConnection&) = delete;
  EventsConnection& operator=(const EventsConnection&) = delete;

  struct Opened {
    bool ok = false;
    std::string error{};
    std::string put_aside{};
    std::optional<std::string> lost{};
    bool new_file = false;  ///< true: rows that were written before are not in the file
  };
  /// Opens the file. The connection must not be open already.
  Opened Open();
  /// Returns the error of the last statement. If the file is damaged, closes the connection; the
  /// next Open puts the file aside.
  Error Failed();
  /// Checks that the disk still contains the open file. If not, closes the connection and returns
  /// an error. To be called periodically, and before each commit. `whole`: reads the whole file,
  /// because a reader has found damage.
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
  std::uint64_t times_put_aside_ = 0;
  /// Why the file must be put aside at the next Open; empty: the file was whole.
  std::string damage_;
  OpenFile open_;
  bool gone_ = false;  ///< true: the file that was open last, or records in it, were lost
};

}  // namespace baudgate::records
