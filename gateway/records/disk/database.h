// `Database` and `Statement` wrap SQLite for the state folder: a connection and a prepared
// statement, without exceptions. Bound texts are copied; returned texts are valid until the next
// step. `ReadOnce` reads a file over a separate connection.
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
  /// `vfs`: the name of an SQLite VFS; empty: the default VFS. After a failure is_open() is false
  /// and error() contains the reason.
  Database(const std::string& path, Mode mode, const std::string& vfs = {});

  bool is_open() const { return handle_ != nullptr; }
  const std::string& error() const { return error_; }
  /// True if the last call failed because the file is not a database, is damaged, or lacks tables
  /// that it had (another program has changed them). Closing the database then changes neither the
  /// file nor its log.
  bool damaged() const { return damaged_; }

  bool Execute(const std::string& sql);
  /// Rolls back a transaction that has failed. error() does not change.
  void Rollback();
  /// Writes the whole write-ahead log to the file. False: a part is still in the log, because
  /// another connection reads, or because the disk fails.
  bool EmptyLog();
  /// Reads the whole file from the disk and returns what is damaged. Empty: nothing is damaged, or
  /// the check itself failed.
  std::optional<std::string> Damage();
  /// Makes closing the database leave the file and its log as they are. To be called when another
  /// file has the name of this file, or when the log is damaged.
  void Abandon();

  /// A database is its main file and its write-ahead log. SizeOf and Read use SQLite's own
  /// descriptors: closing a separate descriptor would end all locks of this process on the file
  /// (fcntl), and the next program that reads the database would remove its log.
  enum class Part : std::uint8_t { file, log };
  /// Returns the size in bytes; empty: the size cannot be read.
  std::optional<std::uint64_t> SizeOf(Part part) const;
  /// Reads `count` bytes from `at`, or fewer if the file ends before. Empty: the bytes cannot be
  /// read.
  std::optional<Bytes> Read(Part part, std::uint64_t at, std::size_t count) const;
  /// Returns the first bytes of the index of the write-ahead log, which all connections share.
  /// Empty: there is no index.
  Bytes ReadIndex(std::size_t count) const;
  /// Returns the first column of the first row; empty: there is no row, or the statement failed.
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
  /// `database` must outlive the statement and must not move. If `sql` cannot be prepared, Next
  /// fails.
  Statement(Database& database, std::string_view sql);

  /// Binds a value to a parameter of the statement; parameters count from 1. An unsigned value
  /// above 2^63 - 1 is bound as a text.
  void Bind(int place, std::int64_t number);
  void Bind(int place, std::string_view text);
  void Bind(int place, const std::string& text) { Bind(place, std::string_view(text)); }
  void Bind(int place, const Value& value);
  void Bind(int place, View bytes);
  void Bind(int place, WallTime time) { Bind(place, std::int64_t{time.time_since_epoch() / 1us}); }

  template <typename Some>
  void Bind(int place, const std::optional<Some>& value) {
    if (value) Bind(place, *value);
  }
  template <typename... Values>
  void BindAll(const Values&... values) {
    int place = 0;
    (Bind(++place, values), ...);
  }

  Step Next();
  /// Binds the values to the parameters from 1 on, runs the statement to its end, and resets it.
  template <typename... Values>
  bool Run(const Values&... values) {
    BindAll(values...);
    return RunToEnd();
  }
  void Reset();

  /// Columns count from 0 and can have any type. A text that is read as a number is 0.
  std::int64_t Number(int column) const;
  std::string_view Text(int column) const;
  double Real(int column) const;
  View Blob(int column) const;
  /// Returns a time from microseconds since 1970. A number out of range is changed to the nearest
  /// time that FormatWallTime can print.
  WallTime Time(int column) const;
  bool IsNull(int column) const;
  /// Returns an integer, a real number or a text; empty for NULL and for a blob.
  Value At(int column) const;

 private:
  struct Closer {
    void operator()(sqlite3_stmt* handle) const;
  };
  bool RunToEnd();

  Database* database_ = nullptr;
  std::unique_ptr<sqlite3_stmt, Closer> handle_;
};

/// Opens the file, calls `read` with the connection, and closes the file. `read` sees the file as
/// it was at one moment. If `read` fails, `damaged` (can be null) is set to true if SQLite has
/// found that the file is damaged, else to false.
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
