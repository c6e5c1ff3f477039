// SPDX-License-Identifier: Apache-2.0
#include "gateway/records/events/event_file.h"

#include <utility>

namespace baudgate::events {

EventFile::EventFile(std::filesystem::path path, std::string vfs,
                     std::shared_ptr<EventsWriter> writer)
    : connection_(std::move(path), std::move(vfs), std::move(writer)) {}

std::optional<EventFile::Opened> EventFile::Open() {
  if (table_) return std::nullopt;
  Opened opened{connection_.Open(), {}};
  if (!opened.ok) return opened;
  table_.emplace(connection_.database());
  opened.contents = table_->Read();
  opened.ok = opened.contents.ok;
  if (opened.ok) {
    lacks_alarms_ = std::exchange(was_open_, true);
    return opened;
  }
  table_.reset();
  opened.error = connection_.Failed().message;
  connection_.Close();
  return opened;
}

Status EventFile::Write(const std::vector<Batch>& batches, const Cursors* cursors,
                        const std::vector<KeptRecord>& records) {
  Status status = connection_.Check();
  const bool due = !batches.empty() || cursors != nullptr || !records.empty();
  if (status && due && !table_->Write(batches, cursors, records)) status = connection_.Failed();
  if (!connection_.is_open()) table_.reset();
  return status;
}

Status EventFile::Check() {
  Status status = connection_.Check(true);
  if (!status) table_.reset();
  return status;
}

Result<std::vector<EventRecord>> EventFile::ReadBehind(std::int64_t after) {
  auto events = table_->ReadBehind(after);
  if (!events) events = connection_.Failed();
  if (!connection_.is_open()) table_.reset();
  return events;
}

Status EventFile::WriteAlarms(const std::vector<Alarm>& alarms) {
  Status status;
  if (table_->WriteAlarms(alarms)) {
    lacks_alarms_ = false;
  } else {
    status = connection_.Failed();
  }
  if (!connection_.is_open()) table_.reset();
  return status;
}

}  // namespace baudgate::events
