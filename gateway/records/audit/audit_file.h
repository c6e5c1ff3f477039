// The audit's part of events.db: opens the file when it is needed, writes what the book has due,
// and reports what went wrong. On one thread (gateway/records/audit/audit_log.h), without a clock
// of its own.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "gateway/records/audit/write_page.h"
#include "gateway/records/audit/write_table.h"
#include "gateway/records/disk/events_connection.h"

namespace baudgate::audit {

class AuditFile {
 public:
  /// As EventsConnection.
  explicit AuditFile(std::filesystem::path path, std::string vfs = {},
                     const std::array<Room, kKinds>& rooms = kRooms,
                     std::shared_ptr<EventsWriter> writer = {});

  using Opened = EventsConnection::Opened;
  /// Empty: it was open already.
  std::optional<Opened> Open();
  /// Only if open. All of them are on the disk, with their seq, or none is.
  Status Write(std::vector<Draft>& drafts);
  /// Only if open. A reader has found damage: the whole file is checked.
  Status Check();
  /// See PutAsideOf.
  std::vector<std::string> PutAside() const { return PutAsideOf(connection_.path()); }
  /// Deletes records beyond the limits. A failure shows at the next write.
  void Tidy(Now now);

  /// See WriteTable. Of a file that is open.
  const std::set<Target>& unsettled() const { return table_->unsettled(); }

  /// See ReadRequests. Of a file that is open.
  Result<std::vector<PastRequest>> PastRequestsAt(WallTime now) {
    return ReadRequests(connection_.database(), now);
  }

  bool is_open() const { return table_.has_value(); }
  const std::filesystem::path& path() const { return connection_.path(); }

 private:
  const std::array<Room, kKinds> rooms_;
  EventsConnection connection_;
  std::optional<WriteTable> table_;
  std::optional<Instant> drop_old_at_;
};

}  // namespace baudgate::audit
