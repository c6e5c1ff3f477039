// SPDX-License-Identifier: Apache-2.0
#include "gateway/records/history/day_file.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <bit>
#include <map>
#include <utility>

#include "gateway/base/text.h"
#include "gateway/records/history/chunk.h"

namespace baudgate::history {
namespace {

enum Kind : std::uint8_t { kNothing, kFlag, kWhole, kCounter, kReal, kText };

}  // namespace

void OpenRows::Add(const Sample& sample) {
  if (sample.point >= current_.size()) current_.resize(sample.point + 1);
  Series& series = current_[sample.point];
  const Entry& entry = sample.entry;
  const bool fits = entry.time - series.begin <= Millis{~std::uint32_t{0}};
  if (!series.rows.empty() &&
      (series.run != sample.run || series.rows.size() == kMostInChunk || !fits)) {
    full_.push_back(std::move(series));
    series = {};
  }
  if (series.rows.empty()) {
    series.point = sample.point;
    series.run = sample.run;
    series.begin = entry.time;
  }
  Row row;
  row.after = static_cast<std::uint32_t>(entry.time - series.begin);
  if (!series.rows.empty() && row.after <= series.rows.back().after) return;
  if (entry.time < series.begin || entry.time <= 0) return;
  row.quality = entry.quality.word();
  row.kind = static_cast<std::uint8_t>(entry.value.index());
  if (const auto* flag = std::get_if<bool>(&entry.value)) {
    row.bits = *flag ? 1 : 0;
  } else if (const auto* whole = std::get_if<std::int64_t>(&entry.value)) {
    row.bits = static_cast<std::uint64_t>(*whole);
  } else if (const auto* counter = std::get_if<std::uint64_t>(&entry.value)) {
    row.bits = *counter;
  } else if (const auto* number = std::get_if<double>(&entry.value)) {
    row.bits = std::bit_cast<std::uint64_t>(*number);
  } else if (const auto* text = std::get_if<std::string>(&entry.value)) {
    row.bits = series.texts.size();
    series.texts.push_back(text->substr(0, kLongestText));
  }
  series.rows.push_back(row);
  oldest_ = size_++ == 0 ? entry.time : std::min(oldest_, entry.time);
}

Entry OpenRows::EntryOf(const Series& series, const Row& row) {
  Entry entry{series.begin + Millis{row.after}, {}, Quality::OfWord(row.quality)};
  switch (row.kind) {
    case kFlag:
      entry.value = row.bits != 0;
      break;
    case kWhole:
      entry.value = static_cast<std::int64_t>(row.bits);
      break;
    case kCounter:
      entry.value = row.bits;
      break;
    case kReal:
      entry.value = std::bit_cast<double>(row.bits);
      break;
    case kText:
      entry.value = series.texts[row.bits];
      break;
    default:
      break;
  }
  return entry;
}

bool OpenRows::Pack(std::size_t entries, std::vector<Chunk>& out) {
  std::vector<Entry> unpacked;
  while (entries > 0 && (!full_.empty() || packed_ < current_.size())) {
    Series& series = full_.empty() ? current_[packed_] : full_.back();
    if (!series.rows.empty()) {
      unpacked.clear();
      for (const Row& row : series.rows) unpacked.push_back(EntryOf(series, row));
      Chunk chunk{series.point,
                  series.run,
                  unpacked.front().time,
                  unpacked.back().time,
                  static_cast<std::int64_t>(unpacked.size()),
                  EncodeChunk(unpacked)};
      if (chunk.bytes.empty()) return false;
      out.push_back(std::move(chunk));
      size_ -= series.rows.size();
      entries -= std::min(entries, series.rows.size());
      series = {};
    }
    if (full_.empty()) {
      ++packed_;
    } else {
      full_.pop_back();
    }
  }
  return true;
}

namespace {

constexpr std::array<const char*, 1> kValueMigrations = {R"sql(
CREATE TABLE points (
  point INTEGER PRIMARY KEY,
  name  TEXT NOT NULL UNIQUE,
  type  TEXT NOT NULL
);
CREATE TABLE runs (
  run   INTEGER PRIMARY KEY,
  began INTEGER NOT NULL,
  until INTEGER NOT NULL,
  why   TEXT NOT NULL
);
CREATE TABLE rows_a (point INTEGER, run INTEGER, time INTEGER, value, quality INTEGER);
CREATE TABLE rows_b (point INTEGER, run INTEGER, time INTEGER, value, quality INTEGER);
CREATE VIEW rows AS SELECT * FROM rows_a UNION ALL SELECT * FROM rows_b;
CREATE TABLE chunks (
  point INTEGER NOT NULL,
  run   INTEGER NOT NULL,
  first INTEGER NOT NULL,
  last  INTEGER NOT NULL,
  count INTEGER NOT NULL,
  bytes BLOB NOT NULL
);
CREATE INDEX chunks_point ON chunks (point, run, first);
)sql"};
/// synchronous=FULL: each commit is on the disk when it returns. With NORMAL, the system could
/// delay commits by up to half a minute.
constexpr records::DatabaseKind kValues = {
    kValuesApplication, kValueMigrations,
    "PRAGMA synchronous=FULL; PRAGMA journal_size_limit=1048576; "
    "PRAGMA wal_autocheckpoint=256;"};

constexpr std::array<const char*, 2> kTables = {"rows_a", "rows_b"};

std::int64_t Whole(const Value& value) {
  const auto* number = std::get_if<std::int64_t>(&value);
  return number == nullptr ? 0 : *number;
}

}  // namespace

std::string DayFileName(Millis day) {
  const std::chrono::year_month_day date(std::chrono::floor<std::chrono::days>(ToWall(day)));
  return fmt::format("values-{:04}{:02}{:02}.db", static_cast<int>(date.year()),
                     static_cast<unsigned>(date.month()), static_cast<unsigned>(date.day()));
}

std::optional<Millis> DayOf(const std::string& file_name) {
  constexpr std::string_view kBegin = "values-";
  constexpr std::string_view kEnd = ".db";
  if (file_name.size() != kBegin.size() + 8 + kEnd.size()) return std::nullopt;
  if (!file_name.starts_with(kBegin) || !file_name.ends_with(kEnd)) return std::nullopt;
  const std::string_view digits = std::string_view(file_name).substr(kBegin.size(), 8);
  const auto year = ParseInteger<unsigned>(digits.substr(0, 4));
  const auto month = ParseInteger<unsigned>(digits.substr(4, 2));
  const auto day = ParseInteger<unsigned>(digits.substr(6, 2));
  if (!year || !month || !day) return std::nullopt;
  const std::chrono::year_month_day date(std::chrono::year(static_cast<int>(*year)),
                                         std::chrono::month(*month), std::chrono::day(*day));
  if (!date.ok()) return std::nullopt;
  return ToMillis(std::chrono::sys_days(date));
}

Value AsType(Value value, config::Type type) {
  if (const auto* whole = std::get_if<std::int64_t>(&value)) {
    if (type == config::Type::boolean) return *whole != 0;
    if (type == config::Type::uint64) return static_cast<std::uint64_t>(*whole);
  } else if (const auto* text = std::get_if<std::string>(&value);
             text != nullptr && type == config::Type::uint64) {
    const auto counter = ParseInteger<std::uint64_t>(*text);
    if (counter) return *counter;
  }
  return value;
}

PointFile::Opened PointFile::Begin(const records::DatabaseKind& kind, const std::string& damage) {
  Opened opened;
  records::OpenedDatabase file = OpenDatabase(path_, kind, vfs_, damage);
  opened.put_aside = std::move(file.put_aside);
  opened.lost = std::move(file.lost);
  error_ = std::move(file.error);
  if (!file.database) return opened;
  damaged_ = false;
  database_ = std::move(file.database);
  open_ = records::OpenFile(path_, vfs_, *database_);
  run_ = records::Statement(*database_, "INSERT OR REPLACE INTO runs VALUES (?,?,?,?)");
  opened.last_run = Whole(database_->First("SELECT coalesce(max(run), 0) FROM runs"));
  opened.ok = true;
  return opened;
}

bool PointFile::Fail() {
  error_ = path_.string() + ": " + database_->error();
  damaged_ = database_->damaged();
  database_->Rollback();
  return false;
}

bool PointFile::ReadPoints(const char* rows,
                           const std::function<void(PointNumber, const records::Statement&)>& use) {
  std::map<std::string, std::size_t, std::less<>> places;
  for (std::size_t i = 0; i < names_.size(); ++i) places[names_[i].name] = i;
  records::Statement row(*database_, rows);
  records::Statement::Step step = row.Next();
  for (; step == records::Statement::Step::row; step = row.Next()) {
    const auto found = places.find(row.Text(1));
    if (found == places.end()) continue;
    ids_[found->second] = row.Number(0);
    use(static_cast<PointNumber>(found->second), row);
  }
  return step == records::Statement::Step::done || Fail();
}

bool PointFile::WriteRuns(const std::vector<Run>& runs) {
  return std::ranges::all_of(runs, [this](const Run& run) {
    return run_.Run(run.number, run.began, run.until, Name(run.why));
  });
}

DayFile::Opened DayFile::Open(const std::string& damage) {
  Opened opened = Begin(kValues, damage);
  if (!opened.ok) return opened;
  for (std::size_t i = 0; i < kTables.size(); ++i) {
    insert_[i] = records::Statement(*database_,
                                    fmt::format("INSERT INTO {} VALUES (?,?,?,?,?)", kTables[i]));
  }
  opened.ok = PackLeftovers(kTables[0]) && PackLeftovers(kTables[1]) && UpdateTypes();
  return opened;
}

bool DayFile::UpdateTypes() {
  std::vector<PointNumber> changed;
  const auto note = [&](PointNumber point, const records::Statement& row) {
    if (row.Text(2) != Name(names_[point].type)) changed.push_back(point);
  };
  if (!ReadPoints("SELECT point, name, type FROM points", note)) return false;
  records::Statement update(*database_, "UPDATE points SET type=? WHERE point=?");
  for (const PointNumber point : changed) {
    if (!update.Run(Name(names_[point].type), ids_[point])) return Fail();
  }
  return true;
}

std::int64_t DayFile::IdOf(PointNumber point) {
  if (ids_[point] != 0) return ids_[point];
  records::Statement insert(*database_,
                            "INSERT INTO points (name, type) VALUES (?,?) RETURNING point");
  insert.BindAll(names_[point].name, Name(names_[point].type));
  if (insert.Next() != records::Statement::Step::row) return 0;
  const std::int64_t id = insert.Number(0);
  return insert.Next() == records::Statement::Step::done ? id : 0;
}

bool DayFile::Write(const std::vector<Sample>& samples, const std::vector<Run>& runs) {
  if (!database_->Execute("BEGIN IMMEDIATE")) return Fail();
  // The points that are new in the file, with their numbers, which are valid only after the commit.
  std::vector<std::pair<PointNumber, std::int64_t>> fresh;
  records::Statement& insert = insert_[table_];
  bool ok = true;
  for (const Sample& sample : samples) {
    if (ids_[sample.point] == 0) {
      const std::int64_t id = IdOf(sample.point);
      if (id == 0) ok = false;
      ids_[sample.point] = id;
      fresh.emplace_back(sample.point, id);
    }
    ok = ok && insert.Run(ids_[sample.point], sample.run, sample.entry.time, sample.entry.value,
                          std::int64_t{sample.entry.quality.word()});
    if (!ok) break;
  }
  ok = ok && WriteRuns(runs) && database_->Execute("COMMIT");
  if (!ok) {
    for (const auto& [point, id] : fresh) ids_[point] = 0;
    return Fail();
  }
  for (const Sample& sample : samples) active_.Add(sample);
  return true;
}

void DayFile::BeginPacking() {
  packed_ = std::move(active_);
  active_ = {};
  table_ = 1 - table_;
  packing_ = true;
}

bool DayFile::NoMemory() {
  error_ = path_.string() + ": not enough memory to compress values";
  return false;
}

bool DayFile::Pack(std::size_t entries) {
  if (!packed_.Pack(entries, chunks_)) {
    return NoMemory();
  }
  if (!packed_.empty()) return true;
  if (!WriteChunks(kTables[1 - table_])) return false;
  packing_ = false;
  packed_ = {};
  chunks_ = {};
  return true;
}

bool DayFile::WriteChunks(const char* table) {
  if (!database_->Execute("BEGIN IMMEDIATE")) return Fail();
  records::Statement insert(*database_, "INSERT INTO chunks VALUES (?,?,?,?,?,?)");
  bool ok = true;
  for (const Chunk& chunk : chunks_) {
    ok = ok && insert.Run(ids_[chunk.point], chunk.run, chunk.first, chunk.last, chunk.count,
                          View(chunk.bytes));
    if (!ok) break;
  }
  ok = ok && database_->Execute(fmt::format("DELETE FROM {}", table));
  ok = ok && database_->Execute("COMMIT");
  return ok || Fail();
}

/// Makes chunks of the rows that an earlier run of the gateway has left, also of points that are no
/// longer stored.
bool DayFile::PackLeftovers(const char* table) {
  std::vector<PointNumber> known;
  OpenRows left;
  {
    records::Statement rows(
        *database_, fmt::format("SELECT r.point, r.run, r.time, r.value, r.quality, p.type FROM {} "
                                "AS r LEFT JOIN points AS p USING (point) ORDER BY r.point, r.run, "
                                "r.time",
                                table));
    records::Statement::Step step = rows.Next();
    for (; step == records::Statement::Step::row; step = rows.Next()) {
      const auto point = static_cast<std::uint64_t>(rows.Number(0));
      if (point == 0 || point > 0xFFFF'FFFF) continue;
      const bool boolean = rows.Text(5) == Name(config::Type::boolean);
      const bool counter = rows.Text(5) == Name(config::Type::uint64);
      const config::Type type = boolean   ? config::Type::boolean
                                : counter ? config::Type::uint64
                                          : config::Type::float64;
      const auto quality = static_cast<std::uint16_t>(rows.Number(4));
      if (known.empty() || known.back() != point) known.push_back(static_cast<PointNumber>(point));
      // The number of a point in the file can be anything, so its index in `known` is used as point
      // number in `left`.
      left.Add({static_cast<PointNumber>(known.size() - 1),
                rows.Number(1),
                {rows.Number(2), AsType(rows.At(3), type), Quality::OfWord(quality)}});
    }
    if (step != records::Statement::Step::done) return Fail();
  }
  if (known.empty()) return true;
  if (!left.Pack(~std::size_t{0}, chunks_)) {
    chunks_.clear();
    return NoMemory();
  }
  const std::vector<std::int64_t> ids = std::exchange(ids_, {known.begin(), known.end()});
  const bool ok = WriteChunks(table);
  ids_ = ids;
  chunks_.clear();
  return ok;
}

}  // namespace baudgate::history
