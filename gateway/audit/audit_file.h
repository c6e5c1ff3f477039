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
#include "gateway/state/events_connection.h"

namespace baudgate::audit {

class AuditFile {
 public:
  /// As EventsConnection.
  explicit AuditFile(std::filesystem::path path, std::string vfs = {},
                     const std::array<Room, kKinds>& rooms = kRooms,
                     std::shared_ptr<EventsWriter> writer = {});

  using Opened = EventsConnection::Opened;
  /// Nothing where it is open and fit for use.
  std::optional<Opened> Open();
  /// Open; all of them are on the disk, with their seq, or none is.
  Status Write(std::vector<Draft>& drafts);
  /// Open: what a reader has found damaged is read as a whole.
  Status Check();
  /// See PutAsideOf.
  std::vector<std::string> PutAside() const { return PutAsideOf(connection_.path()); }
  /// Takes out what there is no room for, and what is too old. Its failures are the next write's.
  void Tidy(Now now);

  /// See WriteTable. Of a file that is open.
  const std::set<Target>& unsettled() const { return table_->unsettled(); }

  bool is_open() const { return table_.has_value(); }
  const std::filesystem::path& path() const { return connection_.path(); }

 private:
  const std::array<Room, kKinds> rooms_;
  EventsConnection connection_;
  std::optional<WriteTable> table_;
  std::optional<Instant> drop_old_at_;
};

}  // namespace baudgate::audit
