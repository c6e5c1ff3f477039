// values-YYYYMMDD.db: what is kept of one day (UTC). Newest entries are rows, which two tables take
// in turn; the rows of the other become chunks in one transaction, so that an entry is never in the
// file twice. docs/history.md has the tables. OpenRows keeps the rows of the day in memory until
// they become chunks.
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

// Entries that stand in a day's file as rows, in memory once more in few bytes each, by point: what
// chunks are made of without reading the rows again.
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
  /// Entries that do not come after the last one of their point and run are left out.
  void Add(const Sample& sample);
  std::size_t size() const { return size_; }
  bool empty() const { return size_ == 0; }
  Millis oldest() const { return oldest_; }  ///< of those that are there

  /// Takes about so many entries out, as chunks. False: there was no memory for it.
  bool Pack(std::size_t entries, std::vector<Chunk>& out);

 private:
  struct Row {
    std::uint64_t bits = 0;
    std::uint32_t after = 0;  // milliseconds after the begin
    std::uint16_t quality = 0;
    std::uint8_t kind = 0;  // of Value
  };
  struct Series {
    PointNumber point = 0;
    std::int64_t run = 0;
    Millis begin = 0;
    std::vector<Row> rows;
    std::vector<std::string> texts;
  };
  static Entry EntryOf(const Series& series, const Row& row);

  std::vector<Series> current_;  // by point
  std::vector<Series> full_;     // of an earlier run, or as long as a chunk may be
  std::size_t packed_ = 0;       // of current_
  std::size_t size_ = 0;
  Millis oldest_ = 0;
};

/// "BGva".
inline constexpr std::int64_t kValuesApplication = 0x42477661;

/// "values-20261123.db" of the day that begins then.
std::string DayFileName(Millis day);
/// Empty: it is not the name of such a file.
std::optional<Millis> DayOf(const std::string& file_name);

/// What a day's file and trends.db have in common: a database with points, runs and their rows. One
/// thread. After a call that failed error() has words, and the file may be closed.
class PointFile {
 public:
  struct Opened {
    bool ok = false;
    std::string put_aside{};  ///< see OpenedDatabase
    std::optional<std::string> lost{};
    std::int64_t last_run = 0;  ///< that the file knows
  };

  const std::string& error() const { return error_; }
  bool damaged() const { return damaged_; }
  records::OpenFile::Look LookAt() { return open_.LookAt(*database_); }
  /// What a reader has found is looked for: all of it is read.
  std::optional<std::string> Damage() { return database_->Damage(); }
  const std::filesystem::path& path() const { return path_; }

 protected:
  /// `names` outlives it.
  PointFile(std::filesystem::path path, const std::vector<PointName>& names, std::string vfs)
      : path_(std::move(path)), names_(names), vfs_(std::move(vfs)), ids_(names.size(), 0) {}

  /// `database_` is null where it cannot be opened.
  Opened Begin(const records::DatabaseKind& kind, const std::string& damage);
  bool Fail();
  /// Rows of the points that have numbers here. `rows`: number, name and what else `use` reads.
  bool ReadPoints(const char* rows,
                  const std::function<void(PointNumber point, const records::Statement& row)>& use);
  bool WriteRuns(const std::vector<Run>& runs);

  const std::filesystem::path path_;
  const std::vector<PointName>& names_;
  const std::string vfs_;
  std::unique_ptr<records::Database> database_;
  records::OpenFile open_;
  records::Statement run_;
  std::vector<std::int64_t> ids_;  // by point; 0: it has none yet
  bool damaged_ = false;
  std::string error_;
};

class DayFile final : public PointFile {
 public:
  /// `names` outlives it.
  DayFile(std::filesystem::path path, const std::vector<PointName>& names, std::string vfs = {})
      : PointFile(std::move(path), names, std::move(vfs)) {}

  /// `damage`: was found while it was in use.
  Opened Open(const std::string& damage = {});

  /// All or none: rows, and the runs as they are now. Samples have numbers of runs as in the file.
  bool Write(const std::vector<Sample>& samples, const std::vector<Run>& runs);

  /// Rows that wait to become chunks are set aside; new ones go to the other table. Not while the
  /// last ones are being packed.
  void BeginPacking();
  bool packing() const { return packing_; }
  /// Packs about so many entries. The last step writes the chunks. Again after a failure.
  bool Pack(std::size_t entries);

  std::size_t open_rows() const { return active_.size(); }
  Millis oldest_row() const { return active_.oldest(); }

 private:
  bool UpdateTypes();
  bool PackLeftovers(const char* table);
  bool WriteChunks(const char* table);
  std::int64_t IdOf(PointNumber point);

  records::Statement insert_[2];
  std::size_t table_ = 0;  // that takes rows
  OpenRows active_;
  OpenRows packed_;  // of the other table
  std::vector<Chunk> chunks_;
  bool packing_ = false;
};

/// A value as it is kept in a row, in the kind of its point.
Value AsType(Value value, config::Type type);

}  // namespace baudgate::history
