// A database file of the gateway as it is opened: it is checked, its tables are brought up to date,
// it is made where it is not there and put aside where it is damaged. What the tables are is its
// owner's affair (gateway/records/disk/events_file.h, gateway/records/history).
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "gateway/records/disk/database.h"

namespace baudgate {

struct DatabaseKind {
  std::int64_t application = 0;  ///< written into the file, so that it is not taken for another's
  /// SQL from each version of the tables to the next. Never changed once released: a file goes
  /// through all that it lacks.
  std::span<const char* const> migrations;
  std::string_view pragmas;  ///< for each connection that writes

  std::int64_t version() const { return static_cast<std::int64_t>(migrations.size()); }
};

struct OpenedDatabase {
  std::unique_ptr<Database> database;  ///< null: `error` says why, and nothing was changed
  std::string error{};
  /// One line for the log: a damaged file was put aside and a new one begun; empty: it was not.
  std::string put_aside{};
  /// One line for the log: what its write-ahead log has lost. Empty: it has lost nothing.
  std::optional<std::string> lost{};
};

/// In WAL mode. One that is damaged, or empty, is renamed to FILE.bad, or .bad2 and so on; one of a
/// newer version is not touched. Takes as long as reading the whole file does. `damage`: what was
/// found while it was in use; it is renamed, whatever it is now. Empty: nothing was found.
OpenedDatabase OpenDatabase(const std::filesystem::path& file, const DatabaseKind& kind,
                            const std::string& vfs = {}, const std::string& damage = {});

/// Names of files that were renamed so and are still there: "events.db.bad".
std::vector<std::string> PutAsideOf(const std::filesystem::path& file);

}  // namespace baudgate
