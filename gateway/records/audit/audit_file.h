// `AuditFile` is the audit's part of events.db: it opens the file when needed, writes the changed
// records of AuditBook, and reports failures. Used by one thread
// (gateway/records/audit/audit_log.h); it reads no clock.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "gateway/records/audit/audit_source.h"
#include "gateway/records/audit/audited_writes.h"
#include "gateway/records/disk/database.h"
#include "gateway/records/disk/events_file.h"

namespace baudgate::audit {

// `WriteTable` writes records to the table `writes` of events.db, in one transaction, and deletes
// the oldest records. Used by one thread; gateway/records/audit/audit_source.h reads the table over
// another connection.

/// How many records of a kind are stored, and for how long. If there are more than `rows`, the
/// oldest record of the point with most records is deleted first, so a client that writes to one
/// point without end displaces no record of other points.
struct Room {
  std::int64_t rows = 0;
  Duration age{};
};
inline constexpr Duration kDay = 24h;
/// The limits of each Kind, in the order of the enumerators: about 60 MB together.
inline constexpr std::array<Room, kKinds> kRooms = {
    Room{200'000, 5 * 366 * kDay}, Room{100'000, 400 * kDay}, Room{20'000, 400 * kDay},
    Room{20'000, 5 * 366 * kDay}};

/// The names of a line and of a device on it.
using Target = std::pair<std::string, std::string>;

class WriteTable {
 public:
  /// `database` must come from OpenEvents (gateway/records/disk/events_file.h), and outlive this
  /// object.
  explicit WriteTable(records::Database& database, const std::array<Room, kKinds>& rooms = kRooms);

  /// Must be called once, before all other functions. Sets the result "unknown" for writes that the
  /// last run of the gateway began and did not end. Afterwards `unsettled()` returns the devices
  /// whose points these writes addressed.
  bool SettleOrphans();
  const std::set<Target>& unsettled() const { return unsettled_; }
  /// Writes all records in one transaction, and sets the seq of new records. False: nothing was
  /// written; database.error() contains the reason.
  bool Write(std::vector<Draft>& drafts);
  /// Deletes the oldest records of each kind that exceeds its number of rows by more than 1 %.
  bool MakeRoom();
  bool DropOld(WallTime now);

 private:
  bool Insert(Draft& draft);
  bool Update(const Draft& draft);
  bool TakeOut(std::size_t kind, std::int64_t rows);
  bool Count();
  bool Transaction(bool done);

  records::Database& database_;
  const std::array<Room, kKinds> rooms_;
  records::Statement insert_;
  records::Statement update_;
  std::array<std::int64_t, kKinds> rows_{};
  std::int64_t settled_ = 0;
  std::set<Target> unsettled_;
};

class AuditFile {
 public:
  explicit AuditFile(std::filesystem::path path, std::string vfs = {},
                     const std::array<Room, kKinds>& rooms = kRooms,
                     std::shared_ptr<records::EventsWriter> writer = {});

  using Opened = records::EventsConnection::Opened;
  /// Opens the file; returns nothing if it is already open.
  std::optional<Opened> Open();
  /// Writes all drafts to the disk and sets their seq, or writes none. The file must be open.
  Status Write(std::vector<Draft>& drafts);
  /// Reads and checks the whole file, which must be open, because a reader has found damage.
  Status Check();
  std::vector<std::string> PutAside() const { return records::PutAsideOf(connection_.path()); }
  void Tidy(Now now);

  /// See WriteTable::unsettled. The file must be open.
  const std::set<Target>& unsettled() const { return table_->unsettled(); }

  /// Returns the latest writes of clients that number their requests; see ReadRequests. The file
  /// must be open.
  Result<std::vector<bus::PastRequest>> PastRequestsAt(WallTime now) {
    return ReadRequests(connection_.database(), now);
  }

  bool is_open() const { return table_.has_value(); }
  const std::filesystem::path& path() const { return connection_.path(); }

 private:
  const std::array<Room, kKinds> rooms_;
  records::EventsConnection connection_;
  std::optional<WriteTable> table_;
  std::optional<Instant> drop_old_at_;
};

}  // namespace baudgate::audit
