// A database file of the gateway as it is opened: it is checked, its tables are brought up to date,
// it is made where it is not there and put aside where it is damaged. What the tables are is its
// owner's affair (gateway/records/disk/events_file.h, gateway/records/history). HeadDamage and
// LogDamage judge a file by its bytes, and OpenFile notices when the disk has lost a file that is
// open.
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

// What can be told of a database from its bytes: whether it is a file at all, whether its head
// makes sense, and whether its write-ahead log has lost what was committed. Source:
// https://www.sqlite.org/fileformat.html, sections 1.3 and 4.

/// Why it must not be opened: the file, its log or its index is a FIFO, a folder or a device, which
/// might block for ever. Empty: all are regular files, or not there.
std::optional<std::string> WhyNoFile(const std::filesystem::path& file);

/// Why this process may not read a file that is there, and what helps. Empty: it may.
std::optional<std::string> WhyNoAccess(const std::filesystem::path& file);

/// What keeps this process from writing to a file that is there, and what helps.
std::string WhyReadOnly(const std::filesystem::path& file);

/// SQLite reads the log up to the first frame that is damaged and says nothing of those behind it.
/// A last transaction that is torn is no loss: it was never committed. Empty: nothing is lost.
std::optional<std::string> LogDamage(const std::filesystem::path& file);

// A database that somebody holds open, and whether the disk still has it: nothing fails at first
// when its file or its log is removed, replaced, shortened or damaged. SQLite has pages in memory,
// and what it commits from then on is lost, or damages the rest.
class OpenFile {
 public:
  OpenFile() = default;
  /// As it is now. `vfs`: as in Database; with one all is well always.
  OpenFile(std::filesystem::path path, const std::string& vfs, Database& database);

  enum class Found : std::uint8_t {
    whole,
    stale,    ///< the log; what it held is in the file now. To be opened again
    lost,     ///< a part of the log; the file has what came before. To be opened again
    gone,     ///< the file. To be opened again; what has its name by now is left alone
    damaged,  ///< the file. To be put aside
  };
  struct Look {
    Found found = Found::whole;
    std::string why{};  ///< for users; empty: it is whole
  };
  /// From time to time, and before each commit. `database` is open on it. A few reads: what is
  /// damaged inside its pages is not seen.
  Look LookAt(Database& database);

 private:
  /// Which file it is. Inode 0: there is none, or nobody knows; errno says which.
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
  Id id_;  // inode 0: it is no file of the system's
  // The log and its index; inode 0: they have not been seen yet.
  Id log_;
  Id index_;
  std::uint64_t longest_ = 0;  // that it was seen
  Bytes head_;
  std::int64_t application_ = 0;
};

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

}  // namespace baudgate::records
