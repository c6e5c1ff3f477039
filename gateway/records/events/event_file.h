// The events' part of events.db: opens the file when it is needed, writes what the book has due,
// and reports what went wrong. On one thread (gateway/records/events/round_writer.h), without a
// clock.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "gateway/records/disk/events_connection.h"
#include "gateway/records/events/event_table.h"

namespace baudgate::events {

class EventFile {
 public:
  /// As EventsConnection.
  explicit EventFile(std::filesystem::path path, std::string vfs = {},
                     std::shared_ptr<EventsWriter> writer = {});

  struct Opened : EventsConnection::Opened {
    EventTable::Contents contents{};
  };
  /// Empty: it was open already.
  std::optional<Opened> Open();
  /// Only if open. All of them are on the disk, or none is. See EventTable.
  Status Write(const std::vector<Batch>& batches, const Cursors* cursors = nullptr,
               const std::vector<KeptRecord>& records = {});
  /// Only if open. A reader has found damage: the whole file is checked.
  Status Check();
  /// See PutAsideOf.
  std::vector<std::string> PutAside() const { return PutAsideOf(connection_.path()); }
  /// Open.
  Result<std::vector<EventRecord>> ReadBehind(std::int64_t after);
  std::int64_t oldest() const { return table_ ? table_->oldest() : 0; }

  /// Whether it was opened again: the file may be a new one, without alarms.
  bool lacks_alarms() const { return lacks_alarms_; }
  /// Only if open. These alarms are on the disk, and no others.
  Status WriteAlarms(const std::vector<Alarm>& alarms);

  const std::filesystem::path& path() const { return connection_.path(); }

 private:
  EventsConnection connection_;
  std::optional<EventTable> table_;
  bool was_open_ = false;
  bool lacks_alarms_ = false;
};

}  // namespace baudgate::events
