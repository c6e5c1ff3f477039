// `Database` and `Statement` are SQLite as the state folder uses it: a connection and a prepared
// statement, without exceptions. Bound texts are copied; returned texts are valid until the next
// step. `ReadOnce` reads a file in its own connection.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <utility>

#include "gateway/base/bytes.h"
#include "gateway/base/result.h"
#include "gateway/base/time.h"
#include "gateway/base/value.h"

struct sqlite3;
struct sqlite3_stmt;

namespace baudgate::records {

/// A connection to a database file. For one thread at a time.
class Database {
 public:
  enum class Mode : std::uint8_t { read, write };  ///< write: the file is made if it does not exist

  Database() = default;
  /// `vfs`: the name of an SQLite VFS; empty: the files of this machine. After a failure is_open()
  /// is false and error() contains the reason.
  Database(const std::string& path, Mode mode, const std::string& vfs = {});

  bool is_open() const { return handle_ != nullptr; }
  /// The reason why the last call failed, in words for users.
  const std::string& error() const { return error_; }
  /// True if the last call failed because the file is no database, is damaged, or lacks tables that
  /// it had (another program has changed them). Closing it then changes neither file nor log.
  bool damaged() const { return damaged_; }

  /// Executes one or several statements; returned rows are ignored.
  bool Execute(const std::string& sql);
  /// Rolls back a transaction that has failed; error() stays.
  void Rollback();
  /// Writes the whole write-ahead log to the file. False: a part is still in the log, because
  /// another connection reads, or the disk fails.
  bool EmptyLog();
  /// Reads the whole file from the disk and returns what is damaged; empty: nothing, or the check
  /// failed.
  std::optional<std::string> Damage();
  /// Closing will change neither file nor log. To be called when another file has its name, or the
  /// log is damaged.
  void Abandon();

  /// Reads bytes as they are on the disk, by SQLite's own descriptors. A separate descriptor must
  /// not be used: closing it would end all locks of this process on the file (fcntl), and the next
  /// program that reads the database would remove its log.
  enum class Part : std::uint8_t { file, log };
  /// The size in bytes. Empty: it cannot be read.
  std::optional<std::uint64_t> SizeOf(Part part) const;
  /// Reads `count` bytes from `at`; fewer if the file ends before. Empty: it cannot be read.
  std::optional<Bytes> Read(Part part, std::uint64_t at, std::size_t count) const;
  /// The first bytes of the index of the log, which all connections share. Empty: there is no
  /// index.
  Bytes ReadIndex(std::size_t count) const;
  /// The first column of the first row. Empty: there is no row, or the statement failed.
  Value First(const std::string& sql);

 private:
  friend class Statement;
  struct Closer {
    void operator()(sqlite3* handle) const;
  };
  bool Fail(int code);
  bool IsTooLarge() const;

  std::unique_ptr<sqlite3, Closer> handle_;
  std::string error_;
  bool damaged_ = false;
};

class Statement {
 public:
  enum class Step : std::uint8_t { row, done, failed };

  Statement() = default;
  /// `database` must outlive the statement and must not move. SQL that cannot be prepared fails at
  /// Next.
  Statement(Database& database, std::string_view sql);

  /// Places count from 1. An unsigned value above 2^63 - 1 is bound as its text.
  void Bind(int place, std::int64_t number);
  void Bind(int place, std::string_view text);
  void Bind(int place, const std::string& text) { Bind(place, std::string_view(text)); }
  void Bind(int place, const Value& value);
  void Bind(int place, View bytes);
  /// Binds microseconds since 1970.
  void Bind(int place, WallTime time) { Bind(place, std::int64_t{time.time_since_epoch() / 1us}); }

  template <typename Some>
  void Bind(int place, const std::optional<Some>& value) {
    if (value) Bind(place, *value);
  }
  /// Binds the values to the places from 1 on.
  template <typename... Values>
  void BindAll(const Values&... values) {
    int place = 0;
    (Bind(++place, values), ...);
  }

  Step Next();
  /// Binds the values to the places from 1 on, runs the statement to its end, and resets it.
  template <typename... Values>
  bool Run(const Values&... values) {
    BindAll(values...);
    return RunToEnd();
  }
  void Reset();

  /// Columns count from 0 and may have any type: a text that is read as a number is 0.
  std::int64_t Number(int column) const;
  std::string_view Text(int column) const;
  double Real(int column) const;
  View Blob(int column) const;
  /// A time from microseconds since 1970; a number out of range becomes a time that FormatWallTime
  /// can print.
  WallTime Time(int column) const;
  bool IsNull(int column) const;
  /// Empty, an integer, a number or a text; a blob is returned as empty.
  Value At(int column) const;

 private:
  struct Closer {
    void operator()(sqlite3_stmt* handle) const;
  };
  bool RunToEnd();

  Database* database_ = nullptr;
  std::unique_ptr<sqlite3_stmt, Closer> handle_;
};

/// Calls `read` with a connection for this call only; all it reads is of one moment. `damaged` (may
/// be null) is set if SQLite has found that the file is damaged.
template <typename Read>
auto ReadOnce(const std::filesystem::path& file, bool* damaged, Read read)
    -> decltype(read(std::declval<Database&>())) {
  Database database(file.string(), Database::Mode::read);
  const auto failed = [&](const std::string& why) {
    if (damaged != nullptr) *damaged = database.damaged();
    return Error{file.string() + ": " + why};
  };
  if (!database.is_open() || !database.Execute("BEGIN")) return failed(database.error());
  auto read_back = read(database);
  if (!read_back) return failed(read_back.error());
  return read_back;
}

}  // namespace baudgate::records
