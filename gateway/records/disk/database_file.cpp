// SPDX-License-Identifier: Apache-2.0
#include "gateway/records/disk/database_file.h"

#include <fmt/format.h>

#include <algorithm>
#include <optional>
#include <system_error>

#include "gateway/records/disk/file_health.h"

namespace baudgate {
namespace {

namespace fs = std::filesystem;

constexpr int kMostPutAside = 99;

/// What the file is; failed: `database` says why.
enum class Look : std::uint8_t { fine, failed, damaged, newer };

bool Migrate(Database& database, const DatabaseKind& kind, std::int64_t version) {
  if (version == kind.version()) return true;
  if (!database.Execute("BEGIN IMMEDIATE")) return false;
  bool ok = true;
  for (auto step = static_cast<std::size_t>(version); ok && step < kind.migrations.size(); ++step) {
    ok = database.Execute(kind.migrations[step]);
  }
  ok = ok && database.Execute(fmt::format("PRAGMA application_id={}", kind.application)) &&
       database.Execute(fmt::format("PRAGMA user_version={}", kind.version())) &&
       database.Execute("COMMIT");
  if (!ok) database.Rollback();
  return ok;
}

Look Broken(const Database& database, std::string& why) {
  why = database.error();
  return database.damaged() ? Look::damaged : Look::failed;
}

std::optional<std::int64_t> WholeNumber(Database& database, const char* sql) {
  const Value value = database.First(sql);
  return std::holds_alternative<std::int64_t>(value) ? std::optional(std::get<std::int64_t>(value))
                                                     : std::nullopt;
}

/// Whose file it is, and which version. `check`: what SQLite says of it.
Look LookAtVersion(Database& database, const DatabaseKind& kind, const std::string& check,
                   std::string& why) {
  const auto application = WholeNumber(database, "PRAGMA application_id");
  const auto version = WholeNumber(database, "PRAGMA user_version");
  const auto tables = WholeNumber(database, "SELECT count(*) FROM sqlite_schema");
  if (!application || !version || !tables) return Broken(database, why);
  if (check != "ok") {
    why = check;
    return Look::damaged;
  }
  const bool fresh = application == 0 && version == 0 && tables == 0;
  if (!fresh && application != kind.application) {
    why = "it belongs to another program";
    return Look::damaged;
  }
  if (version < 0) {
    why = fmt::format("its version is {}", *version);
    return Look::damaged;
  }
  if (version > kind.version()) {
    why = fmt::format("a newer baudgate has made it (version {}, this one knows {})", *version,
                      kind.version());
    return Look::newer;
  }
  return Migrate(database, kind, *version) ? Look::fine : Broken(database, why);
}

/// `head`: its first bytes are there, and looked at before SQLite reads them.
Look LookAt(Database& database, const DatabaseKind& kind, bool head, std::string& why) {
  const auto bytes = head ? database.Read(Database::Part::file, 0, kDatabaseHead) : std::nullopt;
  if (const auto damage = bytes ? HeadDamage(*bytes) : std::nullopt) {
    why = *damage;
    return Look::damaged;
  }
  // A reader of a file that is being recovered waits; a file in WAL mode stays so.
  const Value mode = database.First("PRAGMA journal_mode=WAL");
  if (!HasValue(mode)) return Broken(database, why);
  if (ToText(mode) != "wal") {
    why = "its folder cannot be written";
    return Look::failed;
  }
  if (!database.Execute(std::string(kind.pragmas))) return Broken(database, why);
  const Value check = database.First("PRAGMA quick_check(1)");
  if (!HasValue(check)) return Broken(database, why);
  return LookAtVersion(database, kind, ToText(check), why);
}

/// With its log, which belongs to it. The new name; empty: it cannot be renamed.
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

std::string RenamedText(const fs::path& file, const std::string& why, const fs::path& to) {
  return fmt::format("{} is damaged ({}); it was renamed to {} and a new file was begun",
                     file.string(), why, to.filename().string());
}

/// Some file systems leave this of a file that was there before a power cut. None of ours is empty
/// once it was opened.
bool IsEmpty(const fs::path& file) {
  std::error_code none;
  return fs::is_regular_file(file, none) && fs::file_size(file, none) == 0;
}

}  // namespace

OpenedDatabase OpenDatabase(const fs::path& file, const DatabaseKind& kind, const std::string& vfs,
                            const std::string& damage) {
  OpenedDatabase opened;
  std::error_code none;
  if (vfs.empty()) {
    if (auto why = WhyNoFile(file)) {
      opened.error = *std::move(why);
      return opened;
    }
  }
  if (!damage.empty() && fs::exists(file, none)) {
    const fs::path to = PutAside(file);
    if (to.empty()) {
      opened.error = file.string() + " is damaged, and cannot be renamed";
      return opened;
    }
    opened.put_aside = RenamedText(file, damage, to);
  }
  for (int tries = 0; tries < 2; ++tries) {
    const bool was_there = !vfs.empty() || fs::exists(file, none);
    std::unique_ptr<Database> database;
    std::string why = "it is empty: its content is lost";
    Look look = Look::damaged;
    if (!vfs.empty() || !IsEmpty(file)) {
      if (vfs.empty()) opened.lost = LogDamage(file);
      database = std::make_unique<Database>(file.string(), Database::Mode::write, vfs);
      why = database->error();
      look = database->is_open() ? LookAt(*database, kind, vfs.empty() && was_there, why)
                                 : Look::failed;
    }
    if (look == Look::fine) {
      opened.database = std::move(database);
      if (opened.lost) *opened.lost = file.string() + ": " + *opened.lost;
      return opened;
    }
    opened.error = fmt::format("{}: {}", file.string(), why);
    database.reset();
    // A full disk: it was made, and not written. The next one to look must not take it for a loss.
    if (!was_there && IsEmpty(file)) fs::remove(file, none);
    if (look != Look::damaged) return opened;
    const fs::path to = PutAside(file);
    if (to.empty()) return opened;
    opened.put_aside = RenamedText(file, why, to);
  }
  return opened;
}

std::vector<std::string> PutAsideOf(const fs::path& file) {
  const std::string begin = file.filename().string() + ".bad";
  std::vector<std::string> names;
  std::error_code error;
  for (fs::directory_iterator one(file.parent_path(), error), end; !error && one != end;
       one.increment(error)) {
    std::string name = one->path().filename().string();
    const bool part = name.ends_with("-wal") || name.ends_with("-shm");
    if (name.starts_with(begin) && !part) names.push_back(std::move(name));
  }
  std::ranges::sort(names);
  return names;
}

}  // namespace baudgate
