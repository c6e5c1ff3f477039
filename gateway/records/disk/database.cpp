// SPDX-License-Identifier: Apache-2.0
#include "gateway/records/disk/database.h"

#include <sqlite3.h>

#include <algorithm>
#include <cerrno>
#include <limits>

#include "gateway/base/system_trouble.h"
#include "gateway/records/disk/database_file.h"

namespace baudgate::records {
namespace {

/// A commit waits this long at most for a reader on this machine, such as the program sqlite3.
constexpr int kBusyMs = 250;

sqlite3_file* FileOf(sqlite3* handle, Database::Part part) {
  const bool log = part == Database::Part::log;
  sqlite3_file* file = nullptr;
  sqlite3_file_control(handle, "main",
                       log ? SQLITE_FCNTL_JOURNAL_POINTER : SQLITE_FCNTL_FILE_POINTER, &file);
  return file != nullptr && file->pMethods != nullptr ? file : nullptr;
}

/// True if a table or column is missing. The gateway's own statements are correct, so another
/// program has removed the table or column since the file was opened.
bool NamesMissingTable(const std::string& error) {
  return error.starts_with("no such table: ") || error.starts_with("no such column: ") ||
         error.find(" has no column named ") != std::string::npos;
}

}  // namespace

void Database::Closer::operator()(sqlite3* handle) const { sqlite3_close_v2(handle); }

Database::Database(const std::string& path, Mode mode, const std::string& vfs) {
  if (vfs.empty()) {
    if (auto why = WhyNoFile(path)) {
      error_ = *std::move(why);
      return;
    }
  }
  const int flags =
      mode == Mode::write ? SQLITE_OPEN_READWRITE | SQLITE_OPEN_CREATE : SQLITE_OPEN_READONLY;
  sqlite3* handle = nullptr;
  const int code = sqlite3_open_v2(path.c_str(), &handle, flags | SQLITE_OPEN_NOMUTEX,
                                   vfs.empty() ? nullptr : vfs.c_str());
  handle_.reset(handle);
  if (code != SQLITE_OK) {
    Fail(code);
    handle_.reset();
    if (auto why = vfs.empty() ? WhyNoAccess(path) : std::nullopt) error_ = *std::move(why);
    return;
  }
  if (mode == Mode::write && sqlite3_db_readonly(handle, "main") == 1) {
    handle_.reset();
    error_ = WhyReadOnly(path);
    return;
  }
  sqlite3_extended_result_codes(handle, 1);
  sqlite3_busy_timeout(handle, kBusyMs);
}

bool Database::Fail(int code) {
  error_ = handle_ ? sqlite3_errmsg(handle_.get()) : sqlite3_errstr(code);
  if (error_.empty() || error_ == "not an error") error_ = sqlite3_errstr(code);
  std::ranges::replace(error_, '\n', ' ');  // a quoted schema may contain line breaks
  const int base = code & 0xFF;
  // errno can have changed meanwhile, so SQLite's copy is used.
  const int system = handle_ ? sqlite3_system_errno(handle_.get()) : 0;
  const bool full = system == ENOSPC || system == EDQUOT;
  if (base == SQLITE_IOERR && IsTooLarge()) {
    error_ = SystemTrouble(EFBIG);
  } else if (base == SQLITE_FULL || (base == SQLITE_IOERR && full)) {
    error_ = SystemTrouble(ENOSPC);
  } else if (base == SQLITE_CANTOPEN && NoFileLeft()) {
    error_ = SystemTrouble(EMFILE);
  } else if (base == SQLITE_IOERR) {
    error_ += "; check the disk (dmesg)";
  }
  const bool other_tables = base == SQLITE_ERROR && NamesMissingTable(error_);
  if (other_tables) error_ += ": another program has changed the tables of the file";
  damaged_ = base == SQLITE_CORRUPT || base == SQLITE_NOTADB || other_tables;
  if (damaged_ && handle_) Abandon();
  return false;
}

bool Database::IsTooLarge() const {
  constexpr std::uint64_t kPage = 65536;  // the largest possible page
  const auto most = MostFileBytes();
  if (!most || !handle_) return false;
  return std::max(SizeOf(Part::file).value_or(0), SizeOf(Part::log).value_or(0)) + kPage > *most;
}

bool Database::Execute(const std::string& sql) {
  const int code = sqlite3_exec(handle_.get(), sql.c_str(), nullptr, nullptr, nullptr);
  return code == SQLITE_OK || Fail(code);
}

void Database::Rollback() {
  if (sqlite3_get_autocommit(handle_.get()) != 0) return;
  sqlite3_exec(handle_.get(), "ROLLBACK", nullptr, nullptr, nullptr);
}

bool Database::EmptyLog() {
  const Value busy = First("PRAGMA wal_checkpoint(TRUNCATE)");
  return busy == Value(std::int64_t{0});
}

std::optional<std::string> Database::Damage() {
  sqlite3_db_release_memory(handle_.get());
  damaged_ = false;
  const Value found = First("PRAGMA integrity_check(1)");
  if (!HasValue(found)) return damaged_ ? std::optional(error_) : std::nullopt;
  std::string text = baudgate::ToText(found);
  if (text == "ok") return std::nullopt;
  std::ranges::replace(text, '\n', ' ');
  Abandon();
  return text;
}

std::optional<std::uint64_t> Database::SizeOf(Part part) const {
  sqlite3_file* const file = FileOf(handle_.get(), part);
  sqlite3_int64 size = 0;
  if (file == nullptr || file->pMethods->xFileSize(file, &size) != SQLITE_OK) return std::nullopt;
  return static_cast<std::uint64_t>(size);
}

std::optional<Bytes> Database::Read(Part part, std::uint64_t at, std::size_t count) const {
  const auto size = SizeOf(part);
  if (!size || at >= *size) return size ? std::optional(Bytes()) : std::nullopt;
  Bytes bytes(std::min<std::uint64_t>(count, *size - at));
  sqlite3_file* const file = FileOf(handle_.get(), part);
  const int code = file->pMethods->xRead(file, bytes.data(), static_cast<int>(bytes.size()),
                                         static_cast<sqlite3_int64>(at));
  return code == SQLITE_OK ? std::optional(std::move(bytes)) : std::nullopt;
}

Bytes Database::ReadIndex(std::size_t count) const {
  constexpr int kRegion = 32768;  // the part of the index that SQLite maps at a time
  sqlite3_file* const file = FileOf(handle_.get(), Part::file);
  volatile void* mapped = nullptr;
  const bool shared = file != nullptr && file->pMethods->iVersion >= 2 &&
                      file->pMethods->xShmMap(file, 0, kRegion, 0, &mapped) == SQLITE_OK;
  if (!shared || mapped == nullptr) return {};
  const auto* const from = static_cast<const volatile std::uint8_t*>(mapped);
  return {from, from + count};
}

void Database::Abandon() {
  int on = 1;
  sqlite3_file_control(handle_.get(), "main", SQLITE_FCNTL_PERSIST_WAL, &on);
  sqlite3_db_config(handle_.get(), SQLITE_DBCONFIG_NO_CKPT_ON_CLOSE, 1, nullptr);
}

Value Database::First(const std::string& sql) {
  Statement statement(*this, sql);
  return statement.Next() == Statement::Step::row ? statement.At(0) : Value();
}

void Statement::Closer::operator()(sqlite3_stmt* handle) const { sqlite3_finalize(handle); }

Statement::Statement(Database& database, std::string_view sql) : database_(&database) {
  sqlite3_stmt* handle = nullptr;
  const int code = sqlite3_prepare_v2(database.handle_.get(), sql.data(),
                                      static_cast<int>(sql.size()), &handle, nullptr);
  handle_.reset(handle);
  if (code != SQLITE_OK) database.Fail(code);
}

void Statement::Bind(int place, std::int64_t number) {
  sqlite3_bind_int64(handle_.get(), place, number);
}

void Statement::Bind(int place, std::string_view text) {
  // SQLite would bind a null pointer as NULL.
  sqlite3_bind_text(handle_.get(), place, text.empty() ? "" : text.data(),
                    static_cast<int>(text.size()), SQLITE_TRANSIENT);
}

void Statement::Bind(int place, View bytes) {
  static constexpr std::uint8_t kNothing = 0;
  sqlite3_bind_blob(handle_.get(), place, bytes.empty() ? &kNothing : bytes.data(),
                    static_cast<int>(bytes.size()), SQLITE_TRANSIENT);
}

void Statement::Bind(int place, const Value& value) {
  if (const auto* flag = std::get_if<bool>(&value)) return Bind(place, std::int64_t{*flag});
  if (const auto* whole = std::get_if<std::int64_t>(&value)) return Bind(place, *whole);
  if (const auto* text = std::get_if<std::string>(&value)) return Bind(place, *text);
  if (const auto* number = std::get_if<double>(&value)) {
    sqlite3_bind_double(handle_.get(), place, *number);
  } else if (const auto* counter = std::get_if<std::uint64_t>(&value)) {
    constexpr auto kMost = static_cast<std::uint64_t>(std::numeric_limits<std::int64_t>::max());
    if (*counter > kMost) return Bind(place, baudgate::ToText(value));
    Bind(place, static_cast<std::int64_t>(*counter));
  } else {
    sqlite3_bind_null(handle_.get(), place);
  }
}

Statement::Step Statement::Next() {
  if (!handle_) return Step::failed;
  const int code = sqlite3_step(handle_.get());
  if (code == SQLITE_ROW) return Step::row;
  if (code == SQLITE_DONE) return Step::done;
  database_->Fail(code);
  return Step::failed;
}

bool Statement::RunToEnd() {
  Step step = Step::row;
  while (step == Step::row) step = Next();
  Reset();
  return step == Step::done;
}

void Statement::Reset() {
  sqlite3_reset(handle_.get());
  sqlite3_clear_bindings(handle_.get());
}

std::int64_t Statement::Number(int column) const {
  return sqlite3_column_int64(handle_.get(), column);
}

std::string_view Statement::Text(int column) const {
  const unsigned char* text = sqlite3_column_text(handle_.get(), column);
  const int size = sqlite3_column_bytes(handle_.get(), column);
  if (text == nullptr || size <= 0) return {};
  return {reinterpret_cast<const char*>(text), static_cast<std::size_t>(size)};
}

double Statement::Real(int column) const { return sqlite3_column_double(handle_.get(), column); }

View Statement::Blob(int column) const {
  const auto* bytes = static_cast<const std::uint8_t*>(sqlite3_column_blob(handle_.get(), column));
  const int size = sqlite3_column_bytes(handle_.get(), column);
  if (bytes == nullptr || size <= 0) return {};
  return {bytes, static_cast<std::size_t>(size)};
}

WallTime Statement::Time(int column) const {
  constexpr WallTime kMost = std::chrono::sys_days(std::chrono::year(2200) / 1 / 1);
  constexpr std::int64_t kMicroseconds = kMost.time_since_epoch() / 1us;
  return WallTime(
      std::chrono::microseconds(std::clamp<std::int64_t>(Number(column), 0, kMicroseconds)));
}

bool Statement::IsNull(int column) const {
  return sqlite3_column_type(handle_.get(), column) == SQLITE_NULL;
}

Value Statement::At(int column) const {
  switch (sqlite3_column_type(handle_.get(), column)) {
    case SQLITE_INTEGER:
      return Number(column);
    case SQLITE_FLOAT:
      return sqlite3_column_double(handle_.get(), column);
    case SQLITE_TEXT:
      return std::string(Text(column));
    default:
      return {};
  }
}

}  // namespace baudgate::records
