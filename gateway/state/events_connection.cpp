// SPDX-License-Identifier: Apache-2.0
#include "gateway/state/events_connection.h"

#include <utility>

namespace baudgate {

EventsConnection::EventsConnection(std::filesystem::path path, std::string vfs,
                                   std::shared_ptr<EventsWriter> writer)
    : path_(std::move(path)),
      vfs_(std::move(vfs)),
      writer_(writer ? std::move(writer) : std::make_shared<EventsWriter>()) {}

/// A connection is kept over errors of the disk: what a failed commit has left in the log is
/// written over by the next one. Another connection might take it for done, and it would be
/// doubled.
EventsConnection::Opened EventsConnection::Open() {
  if (writer_->ready) {
    if (Status status = writer_->ready(); !status) return {.error = status.error()};
  }
  // Another connection may have put it aside meanwhile: what is there now is a new one.
  const bool was_damaged = std::exchange(damaged_, false);
  const bool again = was_damaged && times_put_aside_ == writer_->times_put_aside;
  OpenedEvents events = OpenEvents(path_, vfs_, again);
  Opened opened{false, std::move(events.error), std::move(events.put_aside), std::move(events.lost),
                false};
  const bool aside = again || !opened.put_aside.empty();
  if (aside && events.database) ++writer_->times_put_aside;
  opened.new_file = was_damaged || std::exchange(gone_, false) || aside;
  damaged_ = again && !events.database;
  if (!events.database) return opened;
  times_put_aside_ = writer_->times_put_aside;
  database_ = std::move(events.database);
  open_ = OpenFile(path_, vfs_);
  log_gone_ = false;
  opened.ok = true;
  return opened;
}

Error EventsConnection::Failed() {
  Error error{path_.string() + ": " + database_->error()};
  damaged_ = database_->damaged();
  if (damaged_) Close();
  return error;
}

Status EventsConnection::CheckThere() {
  const OpenFile::Found found = open_.Look(*database_);
  if (found == OpenFile::Found::there) return {};
  if (found == OpenFile::Found::log_gone) {
    // It is not opened anew: the other connection still has the log that is gone.
    if (std::exchange(log_gone_, true)) return {};
    return Error{path_.string() + ": " + OpenFile::LogGone()};
  }
  gone_ = true;
  Close();
  return Error{path_.string() + ": it was removed, and all records in it"};
}

}  // namespace baudgate
