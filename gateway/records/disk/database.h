// SQLite as the state folder uses it: a connection and a prepared statement, without exceptions.
// Every text that goes in is copied; every text that comes out lives until the next step. ReadOnce
// reads a file in a connection that ends with the read.
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

/// One thread at a time.
class Database {
 public:
  enum class Mode : std::uint8_t { read, write };  ///< write: made where it is not there

  Database() = default;
  /// `vfs`: SQLite's name of one; empty: the files of this machine. On failure is_open() is false
  /// and error() says why.
  Database(const std::string& path, Mode mode, const std::string& vfs = {});

  bool is_open() const { return handle_ != nullptr; }
  /// Why the last call failed, in words for users.
  const std::string& error() const { return error_; }
  /// The last call failed because the file is no database, a damaged one, or no longer has the
  /// tables that it had: another program has changed them. Closing it touches
  /// neither file nor log.
  bool damaged() const { return damaged_; }

  /// One or several statements; their rows are passed over.
  bool Execute(const std::string& sql);
  /// Ends a transaction that has failed; error() stays.
  void Rollback();
  /// All that its write-ahead log holds goes to the file. False: not all of it, for somebody reads,
  /// or the disk fails.
  bool EmptyLog();
  /// All of it is read from the disk. Why it is damaged; empty: it is not, or that cannot be
  /// said.
  std::optional<std::string> Damage();
  /// Closing touches neither file nor log: another file has its name, or the log is not sound.
  void Abandon();

  /// Bytes as they are on the disk, read by SQLite's own descriptors: whoever opens a file of his
  /// own and closes it ends all locks of this process on that file (fcntl), and the next program
  /// that reads the database takes its log away.
  enum class Part : std::uint8_t { file, log };
  /// Empty: it cannot be read.
  std::optional<std::uint64_t> SizeOf(Part part) const;
  /// The same; fewer where it ends.
  std::optional<Bytes> Read(Part part, std::uint64_t at, std::size_t count) const;
  /// The first bytes of the index of the log, which all connections share. Empty: there is none.
  Bytes ReadIndex(std::size_t count) const;
  /// First column of the first row. Empty: there is none, or the statement failed.
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
  /// `database` outlives it and stays where it is. What cannot be prepared fails at Next.
  Statement(Database& database, std::string_view sql);

  /// From 1 on. A value of 64 unsigned bits that does not fit becomes its text.
  void Bind(int place, std::int64_t number);
  void Bind(int place, std::string_view text);
  void Bind(int place, const std::string& text) { Bind(place, std::string_view(text)); }
  void Bind(int place, const Value& value);
  void Bind(int place, View bytes);
  /// As microseconds since 1970.
  void Bind(int place, WallTime time) { Bind(place, std::int64_t{time.time_since_epoch() / 1us}); }

  /// Nothing where there is no value.
  template <typename Some>
  void Bind(int place, const std::optional<Some>& value) {
    if (value) Bind(place, *value);
  }
  /// From the first place on.
  template <typename... Values>
  void BindAll(const Values&... values) {
    int place = 0;
    (Bind(++place, values), ...);
  }

  Step Next();
  /// Binds from the first place on, runs it to its end, and is ready to be bound again.
  template <typename... Values>
  bool Run(const Values&... values) {
    BindAll(values...);
    return RunToEnd();
  }
  void Reset();

  /// Columns from 0 on, of any type: text where a number is wanted is 0.
  std::int64_t Number(int column) const;
  std::string_view Text(int column) const;
  double Real(int column) const;
  View Blob(int column) const;
  /// A time from microseconds since 1970: whatever stands there, one that FormatWallTime can print.
  WallTime Time(int column) const;
  bool IsNull(int column) const;
  /// Nothing, an integer, a number or a text; bytes are nothing.
  Value At(int column) const;

 private:
  struct Closer {
    void operator()(sqlite3_stmt* handle) const;
  };
  bool RunToEnd();

  Database* database_ = nullptr;
  std::unique_ptr<sqlite3_stmt, Closer> handle_;
};

/// One read, in a connection that ends with it; all of it is of the same moment. `damaged`, where
/// it is given: set if SQLite has found that the file is.
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
