// `DayFile` is values-YYYYMMDD.db: the stored values of one day (UTC). New entries become rows of
// one of two tables, while the rows of the other table become chunks in one transaction. So an
// entry is never in the file twice. docs/history.md describes the tables.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "gateway/base/bytes.h"
#include "gateway/records/disk/database_file.h"
#include "gateway/records/history/batch.h"

namespace baudgate::history {

// `OpenRows` contains a copy of a day file's rows in memory, by point, in few bytes each, so that
// chunks are made without reading the file.
struct Chunk {
  PointNumber point = 0;
  std::int64_t run = 0;
  Millis first = 0;
  Millis last = 0;
  std::int64_t count = 0;
  Bytes bytes;
};

class OpenRows {
 public:
  /// Adds an entry, unless its time is not later than that of the last entry of its point and run.
  void Add(const Sample& sample);
  std::size_t size() const { return size_; }
  bool empty() const { return size_ == 0; }
  /// The time of the oldest entry; valid if there is an entry.
  Millis oldest() const { return oldest_; }

  /// Moves about `entries` entries to `out`, as chunks. Returns false if memory is short.
  bool Pack(std::size_t entries, std::vector<Chunk>& out);

 private:
  struct Row {
    std::uint64_t bits = 0;
    std::uint32_t after = 0;  // milliseconds after Series::begin
    std::uint16_t quality = 0;
    std::uint8_t kind = 0;
  };
  struct Series {
    PointNumber point = 0;
    std::int64_t run = 0;
    Millis begin = 0;
    std::vector<Row> rows;
    std::vector<std::string> texts;
  };
  static Entry EntryOf(const Series& series, const Row& row);

  std::vector<Series> current_;
  // Series of an earlier run, or with kMostInChunk rows; they get no more rows.
  std::vector<Series> full_;
  std::size_t packed_ = 0;
  std::size_t size_ = 0;
  Millis oldest_ = 0;
};

inline constexpr std::int64_t kValuesApplication = 0x42477661;

/// Returns "values-20261123.db" for the day that begins at `day`.
std::string DayFileName(Millis day);
std::optional<Millis> DayOf(const std::string& file_name);

/// `PointFile` is the common part of a day's file and trends.db: a database with points, runs and
/// their rows. Used by one thread. After a failed call, error() contains the reason; if damaged()
/// is true, the owner must close the file.
class PointFile {
 public:
  struct Opened {
    bool ok = false;
    std::string put_aside{};
    std::optional<std::string> lost{};
    std::int64_t last_run = 0;
  };

  const std::string& error() const { return error_; }
  bool damaged() const { return damaged_; }
  records::OpenFile::Look LookAt() { return open_.LookAt(*database_); }
  /// Reads and checks the whole file. To be called if a reader has found damage. Returns what is
  /// damaged; empty: nothing is damaged.
  std::optional<std::string> Damage() { return database_->Damage(); }
  const std::filesystem::path& path() const { return path_; }

 protected:
  PointFile(std::filesystem::path path, const std::vector<PointName>& names, std::string vfs)
      : path_(std::move(path)), names_(names), vfs_(std::move(vfs)), ids_(names.size(), 0) {}

  /// Opens the file; if this fails, `database_` is null. `damage`: damage that was found while the
  /// file was in use; if not empty, the file is put aside first.
  Opened Begin(const records::DatabaseKind& kind, const std::string& damage);
  bool Fail();
  /// Calls `use` for each row of a configured point. `rows`: a query that returns the number and
  /// the name of the point, and columns for `use`.
  bool ReadPoints(const char* rows,
                  const std::function<void(PointNumber point, const records::Statement& row)>& use);
  bool WriteRuns(const std::vector<Run>& runs);

  const std::filesystem::path path_;
  const std::vector<PointName>& names_;
  const std::string vfs_;
  std::unique_ptr<records::Database> database_;
  records::OpenFile open_;
  records::Statement run_;
  std::vector<std::int64_t> ids_;  // each point's number in the file; 0: no number yet
  bool damaged_ = false;
  std::string error_;
};

class DayFile final : public PointFile {
 public:
  /// `names` must outlive this object.
  DayFile(std::filesystem::path path, const std::vector<PointName>& names, std::string vfs = {})
      : PointFile(std::move(path), names, std::move(vfs)) {}

  /// `damage`: damage that was found while the file was in use; if not empty, the file is put
  /// aside.
  Opened Open(const std::string& damage = {});

  /// Writes samples as rows, and the runs; all or nothing. The run numbers must already be those of
  /// the files (PendingValues).
  bool Write(const std::vector<Sample>& samples, const std::vector<Run>& runs);

  /// Begins to pack the present rows; new rows go to the other table. Must not be called while
  /// packing().
  void BeginPacking();
  bool packing() const { return packing_; }
  /// Packs about `entries` entries. The last call writes all chunks and ends packing(). After a
  /// failure, Pack can be called again.
  bool Pack(std::size_t entries);

  std::size_t open_rows() const { return active_.size(); }
  Millis oldest_row() const { return active_.oldest(); }

 private:
  bool UpdateTypes();
  bool PackLeftovers(const char* table);
  bool NoMemory();  // sets error() and returns false
  bool WriteChunks(const char* table);
  std::int64_t IdOf(PointNumber point);

  records::Statement insert_[2];
  std::size_t table_ = 0;  // index of the table that takes new rows
  OpenRows active_;
  OpenRows packed_;
  std::vector<Chunk> chunks_;
  bool packing_ = false;
};

Value AsType(Value value, config::Type type);

}  // namespace baudgate::history
