// `OpenDatabase` opens a database file of the gateway: it checks the file, migrates its tables,
// makes the file if it does not exist, and puts it aside (renames it) if it is damaged. The owners
// define the tables (gateway/records/disk/events_file.h, gateway/records/history).
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "gateway/base/bytes.h"
#include "gateway/records/disk/database.h"

namespace baudgate::records {

// These functions check a database by its bytes: whether it is a regular file, whether its head is
// valid, and whether its write-ahead log has lost committed changes. Source:
// https://www.sqlite.org/fileformat.html, sections 1.3 and 4.

/// Returns why the file must not be opened: the file, its log or its index is a FIFO, a folder or a
/// device, and opening it could block without end. Empty: all are regular files, or do not exist.
std::optional<std::string> WhyNoFile(const std::filesystem::path& file);

/// Returns why this process cannot read an existing file, and the remedy. Empty: the process can
/// read the file.
std::optional<std::string> WhyNoAccess(const std::filesystem::path& file);

std::string WhyReadOnly(const std::filesystem::path& file);

/// Returns which committed changes the write-ahead log has lost; empty: no changes are lost. SQLite
/// reads the log up to the first damaged frame and does not report the frames behind it. An
/// incomplete last transaction is not a loss, because it was never committed.
std::optional<std::string> LogDamage(const std::filesystem::path& file);

// `OpenFile` detects whether the disk still contains a database that is open. SQLite reports no
// error at first when its file or log is removed, replaced, shortened or damaged, because it has
// pages in memory. Changes that SQLite commits from then on are lost, or damage the rest of the
// file.
class OpenFile {
 public:
  OpenFile() = default;
  /// Remembers the present state of the file. `vfs`: as in Database; if it is not empty, LookAt
  /// always returns `whole`.
  OpenFile(std::filesystem::path path, const std::string& vfs, Database& database);

  enum class Found : std::uint8_t {
    whole,
    stale,  ///< the log was lost, but its content is in the file: open the file again
    lost,   ///< a part of the log is lost, but the file contains all earlier changes: open it again
    /// The file was removed or replaced: open it again. The file that has its name now is not
    /// touched.
    gone,
    damaged,  ///< the file is damaged: put it aside
  };
  struct Look {
    Found found = Found::whole;
    std::string why{};
  };
  /// To be called periodically, and before each commit. `database` must be the open connection.
  /// Reads a few pages only; damage inside the other pages is not detected.
  Look LookAt(Database& database);

 private:
  /// Identifies a file. Inode 0: there is no file, or stat failed; errno contains the reason.
  struct Id {
    std::uint64_t device = 0;
    std::uint64_t inode = 0;
    bool operator==(const Id&) const = default;
  };

  Id IdOf(const char* part = "") const;
  void RemoveOwn(const char* part, const Id& id) const;
  std::string HeadTrouble(const Database& database);
  Look LookAtLog(Database& database) const;

  std::filesystem::path path_;
  Id id_;  // inode 0: the file is not checked
  // The log and its index; inode 0: the file was not seen yet.
  Id log_;
  Id index_;
  std::uint64_t longest_ = 0;
  Bytes head_;
  std::int64_t application_ = 0;
};

struct DatabaseKind {
  std::int64_t application = 0;  ///< written into the file, so that the gateway recognises it
  /// SQL statements: entry N leads from version N of the tables to the next. A released entry must
  /// not change: an old file runs through all entries that it lacks.
  std::span<const char* const> migrations;
  std::string_view pragmas;  ///< executed for each connection that writes

  std::int64_t version() const { return static_cast<std::int64_t>(migrations.size()); }
};

struct OpenedDatabase {
  /// Null: `error` contains the reason.
  std::unique_ptr<Database> database;
  std::string error{};
  /// One line for the log: a damaged file was put aside and a new one was begun. Empty: the file
  /// was not damaged.
  std::string put_aside{};
  /// One line for the log: what the write-ahead log has lost. Empty: nothing is lost.
  std::optional<std::string> lost{};
};

/// Opens the file in WAL mode. A damaged or empty file is renamed to FILE.bad, or .bad2 and so on;
/// a file of a newer version is not touched. Takes as long as reading the whole file. If `damage`
/// is not empty, damage was found while the file was in use, and the file is renamed without a
/// check.
OpenedDatabase OpenDatabase(const std::filesystem::path& file, const DatabaseKind& kind,
                            const std::string& vfs = {}, const std::string& damage = {});

/// Returns the names of renamed files that still exist. Example: "events.db.bad".
std::vector<std::string> PutAsideOf(const std::filesystem::path& file);

}  // namespace baudgate::records
