// `AuditFile` is the audit's part of events.db: it opens the file when needed, writes the drafts
// that the book has due, and reports failures. For one thread (gateway/records/audit/audit_log.h);
// time is an argument. `WriteTable` handles the rows of the table `writes`.
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
// the oldest. For one thread; gateway/records/audit/audit_source.h reads the table in another
// connection.

/// How many records of a kind are stored, and how long. Beyond `rows` the oldest record of the
/// point with most records is deleted first, so a client that writes to one point without end
/// displaces no record of other points.
struct Room {
  std::int64_t rows = 0;
  Duration age{};
};
inline constexpr Duration kDay = 24h;
/// The limits by Kind: about 60 MB together.
inline constexpr std::array<Room, kKinds> kRooms = {
    Room{200'000, 5 * 366 * kDay}, Room{100'000, 400 * kDay}, Room{20'000, 400 * kDay},
    Room{20'000, 5 * 366 * kDay}};

/// Line and bare name of a device.
using Target = std::pair<std::string, std::string>;

class WriteTable {
 public:
  /// `database` must come from OpenEvents, and outlive this object.
  explicit WriteTable(records::Database& database, const std::array<Room, kKinds>& rooms = kRooms);

  /// To be called once, before all other functions: writes that the last run began and did not end
  /// become unknown. The devices of those to points are then in `unsettled()`.
  bool SettleOrphans();
  const std::set<Target>& unsettled() const { return unsettled_; }
  /// Writes all records or none. Sets the seq of new records.
  bool Write(std::vector<Draft>& drafts);
  /// Deletes records beyond the rows of their kind.
  bool MakeRoom();
  /// Deletes records that are older than the limit of their kind.
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
  std::int64_t settled_ = 0;  // the last number that was given to a record that has ended
  std::set<Target> unsettled_;
};

class AuditFile {
 public:
  /// The arguments are those of EventsConnection.
  explicit AuditFile(std::filesystem::path path, std::string vfs = {},
                     const std::array<Room, kKinds>& rooms = kRooms,
                     std::shared_ptr<records::EventsWriter> writer = {});

  using Opened = records::EventsConnection::Opened;
  /// Opens the file. Empty: it was open already.
  std::optional<Opened> Open();
  /// The file must be open. Afterwards all drafts are on the disk, with their seq, or none is.
  Status Write(std::vector<Draft>& drafts);
  /// The file must be open. To be called when a reader has found damage: the whole file is checked.
  Status Check();
  /// See PutAsideOf.
  std::vector<std::string> PutAside() const { return records::PutAsideOf(connection_.path()); }
  /// Deletes records beyond the limits. A failure is reported by the next write.
  void Tidy(Now now);

  /// See WriteTable. The file must be open.
  const std::set<Target>& unsettled() const { return table_->unsettled(); }

  /// See ReadRequests. The file must be open.
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
