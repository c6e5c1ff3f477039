// SPDX-License-Identifier: Apache-2.0
#include "gateway/state/events_file.h"

#include <fmt/format.h>

#include <array>
#include <system_error>

namespace baudgate {
namespace {

namespace fs = std::filesystem;

/// From each version to the next. Never changed once released: a file goes through all that it
/// lacks.
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
  settled INTEGER
);
CREATE INDEX writes_point ON writes (kind, line, device, point, seq);
CREATE UNIQUE INDEX writes_settled ON writes (settled);
)sql",
                                                                 R"sql(
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
)sql",
                                                                 R"sql(
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
)sql"};

constexpr int kMostPutAside = 99;

/// What the file is; failed: `database` says why.
enum class Look : std::uint8_t { fine, failed, damaged, newer };

bool Migrate(Database& database, std::int64_t version) {
  if (version == kEventsVersion) return true;
  if (!database.Execute("BEGIN IMMEDIATE")) return false;
  bool ok = true;
  for (auto step = static_cast<std::size_t>(version); ok && step < kMigrations.size(); ++step) {
    ok = database.Execute(kMigrations[step]);
  }
  ok = ok && database.Execute(fmt::format("PRAGMA application_id={}", kEventsApplication)) &&
       database.Execute(fmt::format("PRAGMA user_version={}", kEventsVersion)) &&
       database.Execute("COMMIT");
  if (!ok) database.Rollback();
  return ok;
}

Look LookAt(Database& database, std::string& why) {
  const auto whole = [&](const char* sql) {
    const Value value = database.First(sql);
    return std::holds_alternative<std::int64_t>(value) ? std::get<std::int64_t>(value) : -1;
  };
  const auto broken = [&] {
    why = database.error();
    return database.damaged() ? Look::damaged : Look::failed;
  };
  // A reader of a file that is being recovered waits; a file in WAL mode stays so.
  const Value mode = database.First("PRAGMA journal_mode=WAL");
  if (!HasValue(mode)) return broken();
  if (ToText(mode) != "wal") {
    why = "its folder can not be written";
    return Look::failed;
  }
  if (!database.Execute("PRAGMA synchronous=FULL; PRAGMA journal_size_limit=1048576;")) {
    return broken();
  }
  const Value check = database.First("PRAGMA quick_check(1)");
  if (!HasValue(check)) return broken();
  const std::int64_t application = whole("PRAGMA application_id");
  const std::int64_t version = whole("PRAGMA user_version");
  const std::int64_t tables = whole("SELECT count(*) FROM sqlite_schema");
  if (application < 0 || version < 0 || tables < 0) return broken();
  if (ToText(check) != "ok") {
    why = ToText(check);
    return Look::damaged;
  }
  const bool fresh = application == 0 && version == 0 && tables == 0;
  if (!fresh && application != kEventsApplication) {
    why = "it is another program's";
    return Look::damaged;
  }
  if (version > kEventsVersion) {
    why = fmt::format("a newer baudgate has made it (version {}, this one knows {})", version,
                      kEventsVersion);
    return Look::newer;
  }
  return Migrate(database, version) ? Look::fine : broken();
}

/// With its log, which belongs to it. The new name; empty: it can not be renamed.
fs::path PutAside(const fs::path& file) {
  fs::path to;
  std::error_code error;
  for (int n = 1; n <= kMostPutAside; ++n) {
    to = file.string() + ".bad" + (n == 1 ? "" : std::to_string(n));
    if (!fs::exists(to, error)) break;
  }
  fs::rename(file, to, error);
  if (error) return {};
  for (const char* part : {"-wal", "-shm"}) {
    fs::rename(file.string() + part, to.string() + part, error);
  }
  return to;
}

}  // namespace

OpenedEvents OpenEvents(const fs::path& file, const std::string& vfs, bool put_aside) {
  OpenedEvents opened;
  std::error_code none;
  if (put_aside && fs::exists(file, none) && PutAside(file).empty()) {
    opened.error = file.string() + " is damaged, and can not be renamed";
    return opened;
  }
  for (int tries = 0; tries < 2; ++tries) {
    auto database = std::make_unique<Database>(file.string(), Database::Mode::write, vfs);
    std::string why = database->error();
    const Look look = database->is_open() ? LookAt(*database, why) : Look::failed;
    if (look == Look::fine) {
      opened.database = std::move(database);
      return opened;
    }
    opened.error = fmt::format("{}: {}", file.string(), why);
    if (look != Look::damaged) return opened;
    database.reset();
    const fs::path to = PutAside(file);
    if (to.empty()) return opened;
    opened.put_aside = fmt::format("{} is damaged ({}) and is {} now; a new one is begun",
                                   file.string(), why, to.filename().string());
  }
  return opened;
}

}  // namespace baudgate
