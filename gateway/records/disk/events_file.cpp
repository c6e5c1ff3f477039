// SPDX-License-Identifier: Apache-2.0
#include "gateway/records/disk/events_file.h"

#include <array>

namespace baudgate {
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
  text          TEXT NOT NULL
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

}  // namespace baudgate
