// SPDX-License-Identifier: Apache-2.0
#include "gateway/records/disk/events_file.h"

#include <array>
#include <utility>

namespace baudgate::records {
namespace {

constexpr std::array<const char*, kEventsVersion> kMigrations = {R"sql(
CREATE TABLE writes (
  seq     INTEGER PRIMARY KEY AUTOINCREMENT,
  kind    TEXT NOT NULL,
  time    INTEGER NOT NULL,
  last    INTEGER NOT NULL,
  client  TEXT NOT NULL,
  line    TEXT NOT NULL,
  device  TEXT NOT NULL,
  point   TEXT NOT NULL,
  old,
  first,
  new,
  outcome TEXT,
  reason  TEXT NOT NULL,
  took    INTEGER NOT NULL,
  count   INTEGER NOT NULL,
  settled INTEGER,
  request_client TEXT,
  request_seq,
  request TEXT
);
CREATE INDEX writes_point ON writes (kind, line, device, point, seq);
CREATE UNIQUE INDEX writes_settled ON writes (settled);

CREATE TABLE events (
  seq           INTEGER PRIMARY KEY,
  receive_time  INTEGER NOT NULL,
  device_time   INTEGER NOT NULL,
  clock_quality INTEGER NOT NULL,
  line          TEXT NOT NULL,
  device        TEXT NOT NULL,
  channel       INTEGER NOT NULL,
  code          INTEGER NOT NULL,
  state         TEXT NOT NULL,
  text          TEXT NOT NULL,
  priority      TEXT NOT NULL
);
CREATE INDEX events_device ON events (device, seq);
CREATE TABLE event_sources (
  line   TEXT NOT NULL,
  device TEXT NOT NULL,
  said   TEXT NOT NULL,
  PRIMARY KEY (line, device)
) WITHOUT ROWID;

CREATE TABLE alarms (
  line            TEXT NOT NULL,
  device          TEXT NOT NULL,
  name            TEXT NOT NULL,
  point           TEXT NOT NULL,
  state           TEXT NOT NULL,
  priority        TEXT NOT NULL,
  seq             INTEGER NOT NULL,
  raised          INTEGER NOT NULL,
  changed         INTEGER NOT NULL,
  text            TEXT NOT NULL,
  acknowledged_by TEXT NOT NULL,
  PRIMARY KEY (line, device, name)
) WITHOUT ROWID;

CREATE TABLE event_cursors (
  name TEXT PRIMARY KEY,
  seq  INTEGER NOT NULL,
  sure INTEGER NOT NULL
) WITHOUT ROWID;

CREATE TABLE records (
  kind          TEXT NOT NULL,
  seq           INTEGER NOT NULL,
  line          TEXT NOT NULL,
  device        TEXT NOT NULL,
  name          TEXT NOT NULL,
  event         INTEGER NOT NULL,
  device_time   INTEGER NOT NULL,
  clock_quality INTEGER NOT NULL,
  read_time     INTEGER NOT NULL,
  state         TEXT NOT NULL,
  text          TEXT NOT NULL,
  PRIMARY KEY (kind, seq)
) WITHOUT ROWID;
CREATE UNIQUE INDEX records_same ON records (kind, device, name, device_time, event, line);
CREATE INDEX records_event ON records (event) WHERE event>0;
CREATE TABLE record_values (
  kind    TEXT NOT NULL,
  seq     INTEGER NOT NULL,
  ordinal INTEGER NOT NULL,
  name    TEXT NOT NULL,
  value,
  unit    TEXT NOT NULL,
  quality INTEGER NOT NULL,
  PRIMARY KEY (kind, seq, ordinal)
) WITHOUT ROWID;
CREATE TABLE owed_records (
  event         INTEGER PRIMARY KEY,
  line          TEXT NOT NULL,
  device        TEXT NOT NULL,
  name          TEXT NOT NULL,
  device_time   INTEGER NOT NULL,
  clock_quality INTEGER NOT NULL
);

CREATE TABLE past_points (
  point  INTEGER PRIMARY KEY,
  line   TEXT NOT NULL,
  device TEXT NOT NULL,
  name   TEXT NOT NULL,
  UNIQUE (line, device, name)
);
CREATE TABLE past (
  seq     INTEGER PRIMARY KEY,
  point   INTEGER NOT NULL,
  time    INTEGER NOT NULL,
  span    INTEGER NOT NULL,
  value,
  quality INTEGER
);
CREATE INDEX past_point ON past (point, time, seq);
)sql"};

constexpr DatabaseKind kEvents = {kEventsApplication, kMigrations,
                                  "PRAGMA synchronous=FULL; PRAGMA journal_size_limit=1048576;"};

}  // namespace

OpenedEvents OpenEvents(const std::filesystem::path& file, const std::string& vfs,
                        const std::string& damage) {
  return OpenDatabase(file, kEvents, vfs, damage);
}

EventsConnection::EventsConnection(std::filesystem::path path, std::string vfs,
                                   std::shared_ptr<EventsWriter> writer)
    : path_(std::move(path)),
      vfs_(std::move(vfs)),
      writer_(writer ? std::move(writer) : std::make_shared<EventsWriter>()) {}

void EventsConnection::Close() {
  if (!database_) return;
  database_.reset();
  --writer_->open;
}

/// Open must not be called after every disk error: if the connection stays open, its next commit
/// overwrites what a failed commit has left in the log. A new connection might take the failed
/// commit for a successful one, and its records would be written twice.
EventsConnection::Opened EventsConnection::Open() {
  if (writer_->ready) {
    if (Status status = writer_->ready(); !status) return {.error = status.error()};
  }
  if (writer_->closing && writer_->open > 0) {
    return {.error = path_.string() + ": " + writer_->closing->why};
  }
  writer_->closing.reset();
  // If another connection has put the file aside meanwhile, the file that exists now is a new one
  // and is not damaged.
  std::string damage = std::exchange(damage_, {});
  const bool was_damaged = !damage.empty();
  if (times_put_aside_ != writer_->times_put_aside) damage.clear();
  OpenedEvents events = OpenEvents(path_, vfs_, damage);
  Opened opened{false, std::move(events.error), std::move(events.put_aside), std::move(events.lost),
                false};
  const bool aside = !damage.empty() || !opened.put_aside.empty();
  if (aside && events.database) ++writer_->times_put_aside;
  opened.new_file = was_damaged || std::exchange(gone_, false) || aside;
  if (!events.database) {
    damage_ = std::move(damage);
    return opened;
  }
  times_put_aside_ = writer_->times_put_aside;
  database_ = std::move(events.database);
  ++writer_->open;
  open_ = OpenFile(path_, vfs_, *database_);
  opened.ok = true;
  return opened;
}

Error EventsConnection::Failed() {
  Error error{path_.string() + ": " + database_->error()};
  if (!database_->damaged()) return error;
  damage_ = database_->error();
  Close();
  return error;
}

Status EventsConnection::Leave(std::string why, bool lost) {
  gone_ = gone_ || lost;
  Close();
  return Error{path_.string() + ": " + std::move(why)};
}

Status EventsConnection::Check(bool whole) {
  using Found = OpenFile::Found;
  if (const auto closing = writer_->closing) {
    if (closing->lost) database_->Abandon();
    return Leave(closing->why, closing->lost);
  }
  auto [found, why] = open_.LookAt(*database_);
  if (found == Found::whole && whole) {
    if (auto damage = database_->Damage()) {
      found = Found::damaged;
      why = *std::move(damage);
    }
  }
  switch (found) {
    case Found::whole:
      return {};
    case Found::stale:
    case Found::lost:
      writer_->closing = {why, found == Found::lost};
      return Leave(std::move(why), found == Found::lost);
    case Found::gone:
      if (times_put_aside_ != writer_->times_put_aside)
        why = "the file was damaged and was renamed";
      return Leave(std::move(why), true);
    case Found::damaged:
      damage_ = why;
      return Leave(std::move(why), true);
  }
  return {};
}

}  // namespace baudgate::records
