// SPDX-License-Identifier: Apache-2.0
#include "gateway/records/history/history_files.h"

#include <algorithm>
#include <array>

#include "gateway/records/history/folder_files.h"

namespace baudgate::history {
namespace {

constexpr std::array<const char*, 1> kTrendMigrations = {R"sql(
CREATE TABLE points (
  point INTEGER PRIMARY KEY,
  name  TEXT NOT NULL UNIQUE
);
CREATE TABLE runs (
  run   INTEGER PRIMARY KEY,
  began INTEGER NOT NULL,
  until INTEGER NOT NULL,
  why   TEXT NOT NULL
);
CREATE TABLE minutes (
  point INTEGER NOT NULL,
  begin INTEGER NOT NULL,
  run   INTEGER NOT NULL,
  mean  REAL NOT NULL,
  min   REAL NOT NULL,
  max   REAL NOT NULL,
  first REAL NOT NULL,
  last  REAL NOT NULL,
  count INTEGER NOT NULL,
  good  INTEGER NOT NULL,
  PRIMARY KEY (point, begin, run)
) WITHOUT ROWID;
CREATE TABLE hours (
  point INTEGER NOT NULL,
  begin INTEGER NOT NULL,
  run   INTEGER NOT NULL,
  mean  REAL NOT NULL,
  min   REAL NOT NULL,
  max   REAL NOT NULL,
  first REAL NOT NULL,
  last  REAL NOT NULL,
  count INTEGER NOT NULL,
  good  INTEGER NOT NULL,
  PRIMARY KEY (point, begin, run)
) WITHOUT ROWID;
)sql"};
constexpr records::DatabaseKind kTrends = {
    kTrendsApplication, kTrendMigrations,
    "PRAGMA synchronous=NORMAL; PRAGMA journal_size_limit=1048576; "
    "PRAGMA wal_autocheckpoint=256;"};

}  // namespace

TrendFile::Opened TrendFile::Open(const std::string& damage) {
  Opened opened = Begin(kTrends, damage);
  if (!opened.ok) return opened;
  minute_ =
      records::Statement(*database_, "INSERT OR REPLACE INTO minutes VALUES (?,?,?,?,?,?,?,?,?,?)");
  hour_ =
      records::Statement(*database_, "INSERT OR REPLACE INTO hours VALUES (?,?,?,?,?,?,?,?,?,?)");
  drop_minutes_ = records::Statement(*database_, "DELETE FROM minutes WHERE point=? AND begin<?");
  drop_hours_ = records::Statement(*database_, "DELETE FROM hours WHERE point=? AND begin<?");
  opened.ok = ReadPoints("SELECT point, name FROM points", [](auto&&...) {}) && MendHours();
  return opened;
}

/// Computes missing hours from their minutes. A gateway that was killed has written the minutes of
/// its last hour, but not the hour.
bool TrendFile::MendHours() {
  Run run;
  {
    records::Statement last(*database_,
                            "SELECT run, began, until FROM runs ORDER BY run DESC LIMIT 1");
    const records::Statement::Step step = last.Next();
    if (step == records::Statement::Step::failed) return Fail();
    if (step == records::Statement::Step::done) return true;
    run = {last.Number(0), last.Number(1), last.Number(2), RunBegin::started};
  }
  std::vector<std::int64_t> points;
  {
    records::Statement rows(*database_, "SELECT point FROM points");
    records::Statement::Step step = rows.Next();
    for (; step == records::Statement::Step::row; step = rows.Next()) {
      points.push_back(rows.Number(0));
    }
    if (step != records::Statement::Step::done) return Fail();
  }
  if (!database_->Execute("BEGIN IMMEDIATE")) return Fail();
  for (const std::int64_t point : points) {
    if (!MendHours(point, run)) return Fail();
  }
  return database_->Execute("COMMIT") || Fail();
}

/// Computes the missing hours of a point. Only the last two hours of the run can be missing.
bool TrendFile::MendHours(std::int64_t point, const Run& run) {
  std::map<Millis, Trend> hours;
  {
    records::Statement rows(
        *database_,
        "SELECT begin, mean, min, max, first, last, count, good FROM minutes AS m WHERE "
        "point=?1 AND begin>=?2 AND run=?3 AND good>0 AND NOT EXISTS (SELECT 1 FROM "
        "hours WHERE point=?1 AND begin=m.begin-m.begin%3600000 AND run=?3) ORDER BY "
        "begin");
    rows.BindAll(point, FloorTo(std::max(run.began, run.until - kHour), kHour), run.number);
    records::Statement::Step step = rows.Next();
    for (; step == records::Statement::Step::row; step = rows.Next()) {
      const Trend minute{rows.Number(0), rows.Real(1), rows.Real(2),   rows.Real(3),
                         rows.Real(4),   rows.Real(5), rows.Number(6), rows.Number(7)};
      const Millis begin = FloorTo(minute.begin, kHour);
      const auto [hour, is_new] = hours.try_emplace(begin, minute);
      if (!is_new) Merge(hour->second, minute);
      hour->second.begin = begin;
    }
    if (step != records::Statement::Step::done) return false;
  }
  return std::ranges::all_of(
      hours, [&](const auto& hour) { return InsertSpan(hour_, point, run.number, hour.second); });
}

bool TrendFile::InsertSpan(records::Statement& insert, std::int64_t point, std::int64_t run,
                           const Trend& trend) {
  return insert.Run(point, trend.begin, run, Value(trend.mean), Value(trend.min), Value(trend.max),
                    Value(trend.first), Value(trend.last), trend.count, trend.good);
}

std::int64_t TrendFile::IdOf(PointNumber point) {
  records::Statement insert(*database_, "INSERT INTO points (name) VALUES (?) RETURNING point");
  insert.Bind(1, names_[point].name);
  if (insert.Next() != records::Statement::Step::row) return 0;
  const std::int64_t id = insert.Number(0);
  return insert.Next() == records::Statement::Step::done ? id : 0;
}

bool TrendFile::Insert(const TrendRow& row, std::optional<Millis> sure) {
  const bool hour = row.width == kHour;
  const std::int64_t id = ids_[row.point];
  if (!InsertSpan(hour ? hour_ : minute_, id, row.run, row.trend)) return false;
  if (!hour || !sure) return true;
  const Millis now = std::min(row.trend.begin, *sure);
  drop_minutes_.BindAll(id, now - kKeepMinutes);
  drop_hours_.BindAll(id, now - kKeepHours);
  return drop_minutes_.Run() && drop_hours_.Run();
}

bool TrendFile::Write(const std::vector<TrendRow>& trends, const std::vector<Run>& runs,
                      std::optional<Millis> sure) {
  if (!database_->Execute("BEGIN IMMEDIATE")) return Fail();
  std::vector<PointNumber> fresh;  // points whose number in the file is valid only after the commit
  bool ok = true;
  for (const TrendRow& row : trends) {
    if (ids_[row.point] == 0) {
      fresh.push_back(row.point);
      ids_[row.point] = IdOf(row.point);
      ok = ids_[row.point] != 0;
    }
    ok = ok && Insert(row, sure);
    if (!ok) break;
  }
  if (ok && WriteRuns(runs) && database_->Execute("COMMIT")) return true;
  for (const PointNumber point : fresh) ids_[point] = 0;
  return Fail();
}

namespace {

/// A reading can come this much later than its time, so a reading can still come for the previous
/// hour.
constexpr Millis kLate = 5 * kSecond;

}  // namespace

HistoryFiles::HistoryFiles(std::filesystem::path folder, std::vector<PointName> names,
                           std::string vfs, std::vector<News>& news)
    : folder_(std::move(folder)), names_(std::move(names)), vfs_(std::move(vfs)), news_(news) {}

void HistoryFiles::NoteOpened(const std::string& put_aside,
                              const std::optional<std::string>& lost) {
  if (!put_aside.empty()) news_.push_back({put_aside});
  if (lost) news_.push_back({*lost});
}

Status HistoryFiles::OpenTrends() {
  if (trends_) return {};
  auto file = std::make_unique<TrendFile>(folder_ / kTrendsFile, names_, vfs_);
  const TrendFile::Opened opened = file->Open(damaged_trends_);
  NoteOpened(opened.put_aside, opened.lost);
  if (!opened.ok) return Error{file->error()};
  damaged_trends_.clear();
  last_run_ = std::max(last_run_, opened.last_run);
  trends_ = std::move(file);
  return {};
}

Result<std::int64_t> HistoryFiles::OpenDays(const std::vector<Millis>& days, Millis today) {
  std::int64_t last = 0;
  for (const Millis day : days) {
    auto file = std::make_unique<DayFile>(folder_ / DayFileName(day), names_, vfs_);
    const DayFile::Opened opened = file->Open();
    NoteOpened(opened.put_aside, opened.lost);
    if (!opened.ok) return Error{file->error()};
    last = std::max(last, opened.last_run);
    if (day == today) days_[day] = std::move(file);
  }
  return last;
}

Result<DayFile*> HistoryFiles::Day(Millis day) {
  auto& file = days_[day];
  if (file) return file.get();
  auto fresh = std::make_unique<DayFile>(folder_ / DayFileName(day), names_, vfs_);
  const auto damage = damaged_days_.find(day);
  const bool damaged = damage != damaged_days_.end();
  const DayFile::Opened opened = fresh->Open(damaged ? damage->second : std::string());
  NoteOpened(opened.put_aside, opened.lost);
  if (!opened.put_aside.empty() || (damaged && opened.ok)) lost_ = true;
  if (!opened.ok) {
    days_.erase(day);
    return Error{fresh->error()};
  }
  damaged_days_.erase(day);
  file = std::move(fresh);
  return file.get();
}

Error HistoryFiles::Failed(DayFile& file) {
  Error error{file.error()};
  if (!file.damaged()) return error;
  const auto found =
      std::ranges::find_if(days_, [&](const auto& day) { return day.second.get() == &file; });
  damaged_days_[found->first] = error.message;
  days_.erase(found);
  return error;
}

Status HistoryFiles::WriteTrends(const std::vector<TrendRow>& trends, const std::vector<Run>& runs,
                                 std::optional<Millis> sure) {
  if (!trends_->Write(trends, runs, sure)) {
    Error error{trends_->error()};
    if (trends_->damaged()) {
      damaged_trends_ = trends_->error();
      trends_.reset();
    }
    return error;
  }
  if (!runs.empty()) last_run_ = runs.back().number;
  return {};
}

/// Logs what LookAt has found. Returns true if the file must be closed. A damaged file is logged
/// later, when it is put aside.
bool HistoryFiles::NoteLook(const records::OpenFile::Look& look,
                            const std::filesystem::path& path) {
  using Found = records::OpenFile::Found;
  if (look.found == Found::whole) return false;
  if (look.found != Found::damaged) news_.push_back({path.string() + ": " + look.why});
  return true;
}

void HistoryFiles::Look() {
  using Found = records::OpenFile::Found;
  std::erase_if(days_, [&](const auto& day) {
    const records::OpenFile::Look look = day.second->LookAt();
    if (look.found == Found::damaged) damaged_days_[day.first] = look.why;
    lost_ = lost_ || look.found == Found::gone || look.found == Found::lost;
    return NoteLook(look, day.second->path());
  });
  const records::OpenFile::Look look = trends_ ? trends_->LookAt() : records::OpenFile::Look();
  if (look.found == Found::damaged) damaged_trends_ = look.why;
  if (trends_ && NoteLook(look, trends_->path())) trends_.reset();
}

void HistoryFiles::Check(const std::set<std::string>& files) {
  std::erase_if(days_, [&](const auto& day) {
    const bool doubted = files.contains(DayFileName(day.first));
    const auto damage = doubted ? day.second->Damage() : std::nullopt;
    if (damage) damaged_days_[day.first] = *damage;
    return damage.has_value();
  });
  if (!trends_ || !files.contains(kTrendsFile)) return;
  damaged_trends_ = trends_->Damage().value_or(std::string());
  if (!damaged_trends_.empty()) trends_.reset();
}

Status HistoryFiles::Pack(Millis now, const StoreLimits& limits) {
  const Millis today = FloorTo(now, kDay);
  for (auto at = days_.begin(); at != days_.end();) {
    DayFile& file = *at->second;
    const bool past = at->first != today && now - FloorTo(now, kDay) >= kLate;
    if (!file.packing() && file.open_rows() > 0) {
      const bool hour = FloorTo(file.oldest_row(), kHour) != FloorTo(now - kLate, kHour);
      if (past || hour || file.open_rows() >= limits.open_rows) file.BeginPacking();
    }
    if (file.packing() && !file.Pack(limits.pack_each)) return Failed(file);
    if (past && !file.packing() && file.open_rows() == 0) {
      at = days_.erase(at);  // closing copies the write-ahead log to the file
    } else {
      ++at;
    }
  }
  return {};
}

}  // namespace baudgate::history
