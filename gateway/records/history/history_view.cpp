// SPDX-License-Identifier: Apache-2.0
#include "gateway/records/history/history_view.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>
#include <memory>
#include <system_error>
#include <utility>

#include "gateway/records/disk/database.h"
#include "gateway/records/history/chunk.h"
#include "gateway/records/history/day_file.h"
#include "gateway/records/history/folder_files.h"
#include "gateway/records/history/history_files.h"

namespace baudgate::history {
namespace {

namespace fs = std::filesystem;

constexpr Millis kNever = std::numeric_limits<Millis>::max();

RunBegin RunBeginNamed(std::string_view name) {
  const auto found = std::ranges::find(kRunBegins, name);
  return found == kRunBegins.end() ? RunBegin::started
                                   : static_cast<RunBegin>(found - kRunBegins.begin());
}

class DayReader {
 public:
  DayReader(const fs::path& folder, Millis day, const std::string& point)
      : day_(day), database_((folder / DayFileName(day)).string(), records::Database::Mode::read) {
    if (!database_.is_open()) return;
    records::Statement tables(database_, "SELECT count(*) FROM sqlite_master");
    is_new_ = tables.Next() == records::Statement::Step::row && tables.Number(0) == 0;
    if (is_new_) return;
    records::Statement row(database_, "SELECT point, type FROM points WHERE name=?");
    row.Bind(1, point);
    const records::Statement::Step step = row.Next();
    ok_ = step != records::Statement::Step::failed;
    if (step != records::Statement::Step::row) return;
    point_ = row.Number(0);
    type_ = row.Text(1) == Name(config::Type::boolean)  ? config::Type::boolean
            : row.Text(1) == Name(config::Type::uint64) ? config::Type::uint64
                                                        : config::Type::float64;
  }

  bool ok() const { return ok_; }
  /// True if the file has no tables yet, because the gateway is creating it.
  bool is_new() const { return is_new_; }
  const std::string& error() const { return database_.error(); }
  bool damaged() const { return database_.damaged(); }
  bool damaged_chunk() const { return damaged_chunk_; }
  bool knows() const { return point_.has_value(); }
  Millis day() const { return day_; }

  bool ReadRuns(std::map<std::int64_t, Run>& runs) {
    records::Statement rows(database_, "SELECT run, began, until, why FROM runs");
    records::Statement::Step step = rows.Next();
    for (; step == records::Statement::Step::row; step = rows.Next()) {
      const Run run{rows.Number(0), rows.Number(1), rows.Number(2), RunBeginNamed(rows.Text(3))};
      const auto [found, is_new] = runs.try_emplace(run.number, run);
      found->second.until = std::max(found->second.until, run.until);
    }
    return step == records::Statement::Step::done;
  }

  /// Adds about `most` entries of one run to `out`, oldest first. The entries are later than
  /// `after`.
  bool ReadEntries(std::int64_t run, Millis after, Millis until, std::size_t most,
                   std::vector<Entry>& out) {
    if (!knows()) return true;
    const auto take = [&](Entry entry) {
      const Millis last = out.empty() ? after : std::max(after, out.back().time);
      if (entry.time > last && entry.time < until) out.push_back(std::move(entry));
    };
    // Rows and chunks are read in one transaction, so an entry that becomes a chunk meanwhile is
    // read only once.
    if (!database_.Execute("BEGIN")) return false;
    records::Statement chunks(
        database_,
        "SELECT bytes FROM chunks WHERE point=? AND run=? AND last>? AND first<? "
        "ORDER BY first");
    Bind(chunks, run, after, until);
    records::Statement::Step step = chunks.Next();
    for (; step == records::Statement::Step::row && out.size() < most; step = chunks.Next()) {
      auto entries = DecodeChunk(chunks.Blob(0));
      if (!entries) {  // the other chunks are still readable
        damaged_chunk_ = true;
        continue;
      }
      for (Entry& entry : *entries) take(std::move(entry));
    }
    if (step == records::Statement::Step::failed) return false;
    if (out.size() < most) {
      records::Statement rows(
          database_,
          "SELECT time, value, quality FROM rows WHERE point=? AND run=? AND time>? AND "
          "time<? ORDER BY time");
      Bind(rows, run, after, until);
      step = rows.Next();
      for (; step == records::Statement::Step::row && out.size() < most; step = rows.Next()) {
        take({rows.Number(0), AsType(rows.At(1), type_),
              Quality::OfWord(static_cast<std::uint16_t>(rows.Number(2)))});
      }
    }
    return step != records::Statement::Step::failed;
  }

  void End() { database_.Rollback(); }

 private:
  void Bind(records::Statement& statement, std::int64_t run, Millis after, Millis until) const {
    statement.BindAll(*point_, run, after, until);
  }

  Millis day_;
  records::Database database_;
  bool ok_ = false;
  bool is_new_ = false;
  bool damaged_chunk_ = false;
  std::optional<std::int64_t> point_;
  config::Type type_ = config::Type::float64;
};

class PageReader {
 public:
  PageReader(fs::path folder, const PageQuery& query) : folder_(std::move(folder)), query_(query) {}

  Page Read() {
    OpenDays();
    page_.next = query_.after;
    for (auto run = runs_.lower_bound(query_.after.run); run != runs_.end(); ++run) {
      ReadRun(run);
      if (page_.more) break;
    }
    return std::move(page_);
  }

 private:
  void OpenDays() {
    const FolderFiles files = ListFiles(folder_);
    for (const FolderFiles::Day& day : files.days) {
      if (day.day >= query_.until || day.day + kDay <= query_.since) continue;
      auto reader = std::make_unique<DayReader>(folder_, day.day, query_.point);
      if (reader->is_new()) {
        const bool is_latest = day.day == files.days.back().day;
        if (!is_latest) NoteUnread(*reader, "the file is empty: its content is lost");
        continue;
      }
      // After a damaged file, the other files are still read. A file that is being removed is not
      // reported.
      if (!reader->ok() || !reader->ReadRuns(runs_)) {
        std::error_code none;
        if (fs::exists(folder_ / DayFileName(day.day), none)) NoteUnread(*reader, reader->error());
        continue;
      }
      page_.known = page_.known || reader->knows();
      days_.push_back(std::move(reader));
    }
  }

  void NoteUnread(const DayReader& day, const std::string& why) {
    UnreadFile file{day.day(), DayFileName(day.day()) + ": " + why, day.damaged()};
    if (std::ranges::find(page_.unread, file) == page_.unread.end()) {
      page_.unread.push_back(std::move(file));
    }
  }

  void ReadRun(std::map<std::int64_t, Run>::const_iterator run) {
    const bool goes_on = run->first == query_.after.run;
    if (goes_on && query_.after.time == kNever) return;
    Millis after = std::max(query_.since, std::numeric_limits<Millis>::min() + 1) - 1;
    if (goes_on) after = std::max(after, query_.after.time);
    bool knew = false;
    for (const auto& day : days_) {
      if (day->day() > run->second.until || day->day() + kDay <= run->second.began) continue;
      knew = knew || day->knows();
      std::vector<Entry> entries;
      const std::size_t room = kPage - page_.records.size();
      if (!day->ReadEntries(run->first, after, query_.until, room + 1, entries)) {
        NoteUnread(*day, day->error());
      } else if (day->damaged_chunk()) {
        NoteUnread(*day, "some of its values are damaged");
      }
      day->End();
      for (Entry& entry : entries) {
        if (page_.records.size() == kPage) {
          page_.more = true;
          return;
        }
        after = entry.time;
        page_.next = {run->first, after};
        page_.records.push_back({std::move(entry), {}});
      }
    }
    AddGap(run, knew);
  }

  void AddGap(std::map<std::int64_t, Run>::const_iterator run, bool knew) {
    const auto later = std::next(run);
    const Millis end = run->second.until;
    if (later == runs_.end() || !knew || end < query_.since || end >= query_.until) return;
    if (page_.records.size() == kPage) {
      page_.more = true;
      return;
    }
    page_.records.push_back({{end, {}, {}}, Gap{later->second.began, later->second.why}});
    page_.next = {run->first, kNever};
  }

  const fs::path folder_;
  const PageQuery& query_;
  Page page_;
  std::vector<std::unique_ptr<DayReader>> days_;
  std::map<std::int64_t, Run> runs_;
};

}  // namespace

Result<Page> ReadPage(const fs::path& folder, const PageQuery& query) {
  return PageReader(folder, query).Read();
}

namespace {

struct Part {
  std::int64_t run = 0;
  Trend trend{};
};

constexpr const char* kColumns =
    "SELECT run, begin, mean, min, max, first, last, count, good FROM ";

std::optional<Part> PartOf(const records::Statement& row) {
  Part part{row.Number(0),
            {row.Number(1), row.Real(2), row.Real(3), row.Real(4), row.Real(5), row.Real(6),
             row.Number(7), row.Number(8)}};
  const Trend& trend = part.trend;
  const bool finite = std::isfinite(trend.mean) && std::isfinite(trend.min) &&
                      std::isfinite(trend.max) && std::isfinite(trend.first) &&
                      std::isfinite(trend.last);
  if (!finite || trend.count < 0 || trend.good <= 0 || trend.good > kHour) return std::nullopt;
  return part;
}

class TrendReader {
 public:
  TrendReader(records::Database& database, const TrendQuery& query)
      : database_(database), query_(query) {}

  Result<TrendPage> Read() {
    page_.next = query_.since;
    records::Statement row(database_, "SELECT point FROM points WHERE name=?");
    row.Bind(1, query_.point);
    const records::Statement::Step step = row.Next();
    if (step == records::Statement::Step::failed) return Error{database_.error()};
    if (step == records::Statement::Step::done) return std::move(page_);
    page_.known = true;
    point_ = row.Number(0);
    bool ok = true;
    if (query_.every % kHour == 0) {
      ok = Add("hours", query_.since, "") && AddOpenHour();
    } else {
      ok = Add("minutes", query_.since, "");
    }
    if (!ok) return Error{database_.error()};
    Merge();
    return std::move(page_);
  }

 private:
  /// Adds the minutes of the current hour of the last run, because this hour has no row yet.
  bool AddOpenHour() {
    records::Statement run(database_, "SELECT run, began FROM runs ORDER BY run DESC LIMIT 1");
    const records::Statement::Step step = run.Next();
    if (step != records::Statement::Step::row) return step == records::Statement::Step::done;
    const std::int64_t number = run.Number(0);
    records::Statement last(
        database_,
        "SELECT begin FROM hours WHERE point=? AND begin>=? AND run=? ORDER BY begin "
        "DESC LIMIT 1");
    last.BindAll(point_, FloorTo(run.Number(1), kHour), number);
    Millis from = FloorTo(run.Number(1), kMinute);
    if (last.Next() == records::Statement::Step::row) from = last.Number(0) + kHour;
    return Add("minutes", std::max(from, query_.since), " AND run=" + std::to_string(number));
  }

  bool Add(const char* table, Millis since, const std::string& where) {
    records::Statement rows(database_, std::string(kColumns) + table +
                                           " WHERE point=? AND begin>=? AND begin<?" + where +
                                           " ORDER BY begin, run");
    rows.BindAll(point_, since, query_.until);
    // A page contains at most kPage spans. The client requests the next page.
    std::size_t spans = 0;
    Millis span = std::numeric_limits<Millis>::min();
    records::Statement::Step step = rows.Next();
    for (; step == records::Statement::Step::row; step = rows.Next()) {
      const auto part = PartOf(rows);
      if (!part) continue;
      const Millis begin = FloorTo(part->trend.begin, query_.every);
      if (begin != span && ++spans > kPage) {
        end_ = std::min(end_, begin);
        return true;
      }
      span = begin;
      parts_.push_back(*part);
    }
    return step == records::Statement::Step::done;
  }

  void Merge() {
    std::ranges::stable_sort(parts_, [&](const Part& a, const Part& b) {
      const Millis begin_a = FloorTo(a.trend.begin, query_.every);
      const Millis begin_b = FloorTo(b.trend.begin, query_.every);
      if (begin_a != begin_b) return begin_a < begin_b;
      return a.run != b.run ? a.run < b.run : a.trend.begin < b.trend.begin;
    });
    for (const Part& part : parts_) {
      const Millis begin = FloorTo(part.trend.begin, query_.every);
      if (begin >= end_) break;
      if (page_.spans.empty() || page_.spans.back().begin != begin) {
        page_.spans.push_back(part.trend);
        page_.spans.back().begin = begin;
      } else {
        history::Merge(page_.spans.back(), part.trend);
      }
    }
    page_.more = end_ != std::numeric_limits<Millis>::max();
    if (page_.more) page_.next = end_;
  }

  records::Database& database_;
  const TrendQuery& query_;
  std::int64_t point_ = 0;
  std::vector<Part> parts_;
  Millis end_ = std::numeric_limits<Millis>::max();
  TrendPage page_;
};

}  // namespace

Result<TrendPage> ReadTrends(const std::filesystem::path& folder, const TrendQuery& query,
                             bool* damaged) {
  TrendQuery whole = query;  // `since` is changed to the beginning of a span
  whole.since = FloorTo(query.since, query.every);
  // ReadOnce reads in one transaction, so an hour that ends meanwhile is counted only once.
  return records::ReadOnce(folder / kTrendsFile, damaged, [&](records::Database& database) {
    return TrendReader(database, whole).Read();
  });
}

bool UnreadFiles::Note(const UnreadFile& file, const PageQuery& query) {
  const bool known = std::ranges::find(entries_, file, &Entry::file) != entries_.end();
  if (known || entries_.size() >= kMost) return false;
  PageQuery its = query;
  its.since = std::max(its.since, file.day);
  its.until = std::min(its.until, file.day + kDay);
  entries_.push_back({file, std::move(its)});
  return true;
}

void UnreadFiles::Forget(const UnreadFile& file) {
  std::erase_if(entries_, [&](const Entry& entry) { return entry.file == file; });
}

bool UnreadFiles::CanBeRead(const std::filesystem::path& folder, const Entry& entry) {
  const auto page = ReadPage(folder, entry.query);
  return page && std::ranges::find(page->unread, entry.file) == page->unread.end();
}

HistoryState HistoryView::state() const {
  const MutexLock lock(mutex_);
  HistoryState state = state_;
  for (const UnreadFiles::Entry& entry : unread_.entries()) state.unread.push_back(entry.file.text);
  return state;
}

Result<Page> HistoryView::Read(const PageQuery& query) const {
  if (options_.folder.empty()) return Error{options_.why_no_folder};
  if (state().disk == records::Disk::opening) return Page{.next = query.after, .known = true};
  auto page = ReadPage(options_.folder, query);
  if (!page) return page;
  for (const UnreadFile& file : page->unread) Note(file, query);
  return page;
}

/// Logs that a file could not be read, once for each file. A damaged file is reported to the
/// writing thread.
void HistoryView::Note(const UnreadFile& file, const PageQuery& query) const {
  {
    const MutexLock lock(mutex_);
    if (file.damaged) doubts_.insert(DayFileName(file.day));
    if (!unread_.Note(file, query)) return;
  }
  options_.warn("history: " + file.text + "; query results lack values of this file");
}

Result<TrendPage> HistoryView::ReadTrends(const TrendQuery& query) const {
  if (options_.folder.empty()) return Error{options_.why_no_folder};
  if (state().disk == records::Disk::opening) return TrendPage{.next = query.since, .known = true};
  bool damaged = false;
  auto page = history::ReadTrends(options_.folder, query, &damaged);
  if (damaged) {
    const MutexLock lock(mutex_);
    doubts_.insert(kTrendsFile);
  }
  return page;
}

std::set<std::string> HistoryView::TakeDoubts() {
  const MutexLock lock(mutex_);
  return std::exchange(doubts_, {});
}

void HistoryView::LookAgain() {
  std::vector<UnreadFiles::Entry> entries;
  {
    const MutexLock lock(mutex_);
    entries = unread_.entries();
  }
  for (const UnreadFiles::Entry& entry : entries) {
    if (!UnreadFiles::CanBeRead(options_.folder, entry)) continue;
    {
      const MutexLock lock(mutex_);
      unread_.Forget(entry.file);
    }
    options_.inform("history: this problem is solved: " + entry.file.text);
  }
}

namespace {

/// The value at the beginning of a chart is searched this far back, because an unchanged value is
/// usually stored again within this time (max_gap).
constexpr Millis kLookBack = kHour;
// A chart that would need more pages of values than this is computed from the means over minutes.
constexpr std::size_t kMostPages = 200;

constexpr std::array<Millis, 8> kSteps = {1 * kSecond,  2 * kSecond,  5 * kSecond,  10 * kSecond,
                                          15 * kSecond, 20 * kSecond, 30 * kSecond, kMinute};

Millis StepOf(const ChartQuery& query) {
  const Millis pixels = std::clamp<Millis>(query.pixels, 1, kMostPixels);
  const Millis least = (query.until - query.since + pixels - 1) / pixels;
  for (const Millis step : kSteps) {
    if (step >= least) return step;
  }
  return (least + kMinute - 1) / kMinute * kMinute;
}

std::optional<double> GoodValue(const Entry& entry) {
  if (!IsGood(entry.quality) || !HasValue(entry.value)) return std::nullopt;
  return ToDouble(entry.value);
}

/// Sorts rows by time and merges rows of the same step, because runs overlap if the clock was set
/// back.
void Tidy(std::vector<Trend>& rows, Millis since) {
  std::erase_if(rows, [since](const Trend& row) { return row.begin < since; });
  std::ranges::stable_sort(rows, {}, &Trend::begin);
  std::vector<Trend> tidy;
  for (const Trend& row : rows) {
    if (!tidy.empty() && tidy.back().begin == row.begin) {
      Merge(tidy.back(), row);
    } else {
      tidy.push_back(row);
    }
  }
  rows = std::move(tidy);
}

/// Computes a chart from stored values. Returns nothing if the range contains too many values.
Result<std::optional<Chart>> FromValues(const HistorySource& source, const ChartQuery& query,
                                        Millis step) {
  Chart chart{.step = step};
  Rollup rollup(step);
  PageQuery page_query{
      .point = query.point, .since = query.since - kLookBack, .until = query.until};
  Millis last = 0;
  for (std::size_t pages = 0;; ++pages) {
    if (pages == kMostPages) return std::optional<Chart>();
    const auto page = source.Read(page_query);
    if (!page) return Error{page.error()};
    chart.known = chart.known || page->known;
    for (const HistoryRecord& record : page->records) {
      if (record.gap || record.entry.time < last)
        rollup.Forget(std::max(last, record.entry.time), chart.rows);
      last = record.entry.time;
      if (!record.gap) rollup.Set(last, GoodValue(record.entry), true, chart.rows);
    }
    if (!page->more) break;
    page_query.after = page->next;
  }
  rollup.Forget(std::max(last, query.until), chart.rows);
  Tidy(chart.rows, FloorTo(query.since, step));
  return std::optional(std::move(chart));
}

Result<Chart> FromTrends(const HistorySource& source, const ChartQuery& query, Millis step) {
  Chart chart{.step = std::max(step, kMinute)};
  TrendQuery trend{
      .point = query.point, .since = query.since, .until = query.until, .every = chart.step};
  for (std::size_t pages = 0; pages < kMostPages; ++pages) {
    const auto page = source.ReadTrends(trend);
    if (!page) return Error{page.error()};
    chart.known = chart.known || page->known;
    chart.rows.insert(chart.rows.end(), page->spans.begin(), page->spans.end());
    if (!page->more) break;
    trend.since = page->next;
  }
  return chart;
}

}  // namespace

Result<Chart> ReadChart(const HistorySource& source, const ChartQuery& query) {
  const Millis step = StepOf(query);
  if (query.until - query.since <= kDay && step <= kMinute) {
    auto chart = FromValues(source, query, step);
    if (!chart) return Error{chart.error()};
    if (*chart) return std::move(**chart);
  }
  return FromTrends(source, query, step);
}

}  // namespace baudgate::history
