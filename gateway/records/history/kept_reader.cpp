// SPDX-License-Identifier: Apache-2.0
#include "gateway/records/history/kept_reader.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <system_error>
#include <tuple>
#include <unordered_map>
#include <utility>

#include "gateway/records/disk/database.h"
#include "gateway/records/history/chunk.h"
#include "gateway/records/history/day_file.h"
#include "gateway/records/history/recorder.h"

namespace baudgate::history {
namespace {

namespace fs = std::filesystem;
using Step = records::Statement::Step;

constexpr Millis kSettle = Recorder::kSettle;
/// A file is read again for this time after a change, because two changes can have the same time.
constexpr Duration kStable = 2s;
/// The writer marks today's file this often, so a shorter time without a file proves no loss.
constexpr Millis kLeastGap = 15 * kSecond;

config::Type TypeNamed(std::string_view name) {
  for (const config::Type type : {config::Type::boolean, config::Type::uint64}) {
    if (name == Name(type)) return type;
  }
  return config::Type::float64;
}

}  // namespace

// `KeptReader::Span` is one span of one day's file: the points of the file and the rows of the span
// in memory. Chunks are decoded one after the other, when their values are wanted.
class KeptReader::Span {
 public:
  Span(const fs::path& folder, Millis day, const Pass& pass)
      : day_(day),
        pass_(pass),
        database_((folder / DayFileName(day)).string(), records::Database::Mode::read) {}

  bool Is(const Pass& pass) const {
    return pass.run == pass_.run && pass.from == pass_.from && pass.until == pass_.until;
  }
  Millis day() const { return day_; }
  /// The end of the span, which Load has moved if there are many rows.
  Millis until() const { return pass_.until; }
  bool damaged() const { return database_.damaged(); }
  const std::string& error() const { return database_.error(); }

  /// `whole`: loads all rows up to the end of the span, however many there are.
  bool Load(bool whole) {
    // Rows and the decision about chunks belong to one state of the file: afterwards, rows that
    // become chunks come twice, and the second copy is left out by its time.
    if (!database_.is_open() || !database_.Execute("BEGIN")) return false;
    const bool ok = LoadPoints() && LoadRows(whole);
    database_.Rollback();
    std::ranges::sort(rows_, [](const Row& a, const Row& b) {
      return std::tie(a.point, a.entry.time) < std::tie(b.point, b.entry.time);
    });
    return ok;
  }

  /// Appends values after `pass` to the part, at most `most`. Sets part.next.
  bool Read(std::size_t most, StoredPart& part) {
    Pass& next = part.next;
    auto at = std::ranges::lower_bound(points_, next.point, {}, &Point::name);
    for (; at != points_.end(); ++at) {
      if (at->name != next.point) next.time = pass_.from;
      next.point = at->name;
      next.time = std::max(next.time, pass_.from);
      const auto index = static_cast<std::uint32_t>(at - points_.begin());
      if (!ReadPoint(index, most, part)) return false;
      if (part.values.size() >= most) return true;
      if (has_chunks_) continue;
      // If no chunk belongs to the span, the next point is the next one that has a row.
      const auto row = std::ranges::upper_bound(rows_, index, {}, &Row::point);
      if (row == rows_.end()) break;
      at += row->point - index - 1;
    }
    next.from = next.until = pass_.until;
    next.point.clear();
    next.time = 0;
    return true;
  }

 private:
  struct Point {
    std::int64_t id = 0;
    std::string name;
    config::Type type = config::Type::float64;
  };
  struct Row {
    std::uint32_t point = 0;  // index in points_
    Entry entry{};
  };
  struct Key {
    std::int64_t run = 0;
    Millis time = 0;
    auto operator<=>(const Key&) const = default;
  };

  bool LoadPoints() {
    records::Statement rows(database_, "SELECT point, name, type FROM points ORDER BY name");
    Step step = rows.Next();
    for (; step == Step::row; step = rows.Next()) {
      points_.push_back({rows.Number(0), std::string(rows.Text(1)), TypeNamed(rows.Text(2))});
    }
    return step == Step::done;
  }

  bool LoadRows(bool whole) {
    std::unordered_map<std::int64_t, std::uint32_t> places;
    for (std::uint32_t i = 0; i < points_.size(); ++i) places[points_[i].id] = i;
    std::vector<std::pair<Key, const char*>> tables;  // oldest rows first
    for (const char* table : {"rows_a", "rows_b"}) {
      records::Statement first(
          database_, fmt::format("SELECT run, time FROM {} ORDER BY rowid LIMIT 1", table));
      const Step step = first.Next();
      if (step == Step::failed) return false;
      if (step == Step::row) tables.push_back({{first.Number(0), first.Number(1)}, table});
    }
    std::ranges::sort(tables);
    // Entries in chunks were stored before all rows, so their times are at most kSettle later than
    // the time of the first row.
    has_chunks_ =
        tables.empty() || tables[0].first > Key{pass_.run, std::max(pass_.from, kSettle) - kSettle};
    std::size_t most = whole ? ~std::size_t{0} : kMostRows;
    for (const auto& [first, table] : tables) {
      bool ended = false;
      if (!LoadTable(table, places, most, ended)) return false;
      if (ended) break;
    }
    return true;
  }

  /// Rows are in the order in which they were stored, so each time is at most kSettle earlier than
  /// the latest time before it.
  bool LoadTable(const char* table, const std::unordered_map<std::int64_t, std::uint32_t>& places,
                 std::size_t& most, bool& ended) {
    const std::optional<std::int64_t> begin = FirstRow(table);
    if (!begin) return false;
    records::Statement rows(
        database_, fmt::format("SELECT run, time, point, value, quality FROM {} WHERE rowid>=? "
                               "ORDER BY rowid",
                               table));
    rows.Bind(1, *begin);
    Step step = rows.Next();
    Millis latest = pass_.from;
    for (; step == Step::row && !ended; step = rows.Next()) {
      const Key key{rows.Number(0), rows.Number(1)};
      ended = key > Key{pass_.run, pass_.until + kSettle};
      if (key.run != pass_.run || key.time <= pass_.from || key.time > pass_.until) continue;
      const auto place = places.find(rows.Number(2));
      if (place == places.end()) continue;
      latest = std::max(latest, key.time);
      rows_.push_back({place->second,
                       {key.time, AsType(rows.At(3), points_[place->second].type),
                        Quality::OfWord(static_cast<std::uint16_t>(rows.Number(4)))}});
      if (rows_.size() >= most && latest - kSettle - 1 > pass_.from) {
        pass_.until = latest - kSettle - 1;
        std::erase_if(rows_, [this](const Row& row) { return row.entry.time > pass_.until; });
        ended = true;
      }
    }
    return step != Step::failed;
  }

  /// Returns a row so that all rows of the span come at it or after it.
  std::optional<std::int64_t> FirstRow(const char* table) {
    records::Statement range(database_,
                             fmt::format("SELECT min(rowid), max(rowid) FROM {}", table));
    if (range.Next() != Step::row) return std::nullopt;
    std::int64_t low = range.Number(0);
    std::int64_t high = range.Number(1) + 1;
    const Key wanted{pass_.run, pass_.from - kSettle};
    records::Statement row(
        database_,
        fmt::format("SELECT run, time FROM {} WHERE rowid>=? ORDER BY rowid LIMIT 1", table));
    while (low < high) {
      const std::int64_t middle = low + (high - low) / 2;
      row.Reset();
      row.Bind(1, middle);
      const Step step = row.Next();
      if (step == Step::failed) return std::nullopt;
      if (step == Step::row && Key{row.Number(0), row.Number(1)} < wanted) {
        low = middle + 1;
      } else {
        high = middle;
      }
    }
    return low;
  }

  bool ReadPoint(std::uint32_t index, std::size_t most, StoredPart& part) {
    Pass& next = part.next;
    const Point& point = points_[index];
    const auto take = [&](const Entry& entry) {
      if (entry.time <= next.time || entry.time > pass_.until) return;
      part.values.push_back({point.name, entry});
      next.time = entry.time;
    };
    while (has_chunks_ && part.values.size() < most) {
      if (chunk_point_ != index || chunk_.empty() || chunk_.back().time <= next.time) {
        bool found = false;
        if (!NextChunk(index, part, found)) return false;
        if (!found) break;
      }
      auto at = std::ranges::upper_bound(chunk_, next.time, {}, &Entry::time);
      if (at == chunk_.end() || at->time > pass_.until) break;
      for (; at != chunk_.end() && part.values.size() < most; ++at) take(*at);
    }
    auto row = std::ranges::upper_bound(
        rows_, std::tuple(index, next.time), {},
        [](const Row& its) { return std::tuple(its.point, its.entry.time); });
    for (; row != rows_.end() && row->point == index && part.values.size() < most; ++row) {
      take(row->entry);
    }
    return true;
  }

  /// Decodes the first chunk that has values of the point after part.next.time. Skips a chunk that
  /// is damaged.
  bool NextChunk(std::uint32_t index, StoredPart& part, bool& found) {
    records::Statement chunks(database_,
                              "SELECT bytes, first, last FROM chunks WHERE point=? AND run=? AND "
                              "last>? AND first<=? ORDER BY first");
    chunks.BindAll(points_[index].id, pass_.run, part.next.time, pass_.until);
    Step step = chunks.Next();
    for (; step == Step::row; step = chunks.Next()) {
      auto entries = DecodeChunk(chunks.Blob(0));
      if (!entries) {
        const Millis last = std::min(chunks.Number(2), pass_.until);
        part.lost.push_back(
            {chunks.Number(1), last,
             fmt::format("{}: values of {} are damaged", DayFileName(day_), points_[index].name)});
        part.next.time = std::max(part.next.time, last);
        continue;
      }
      if (entries->empty() || entries->back().time <= part.next.time) continue;
      chunk_ = std::move(*entries);
      chunk_point_ = index;
      found = true;
      return true;
    }
    return step == Step::done;
  }

  const Millis day_;
  Pass pass_;
  records::Database database_;
  std::vector<Point> points_;  // sorted by name
  std::vector<Row> rows_;      // sorted by point and time
  bool has_chunks_ = true;
  std::uint32_t chunk_point_ = 0;
  std::vector<Entry> chunk_;  // the chunk decoded last, of the point chunk_point_
};

KeptReader::KeptReader(fs::path folder) : folder_(std::move(folder)) {}
KeptReader::~KeptReader() = default;

/// Lists the files, and reads the runs of those that have changed.
void KeptReader::Look() {
  const FolderFiles files = ListFiles(folder_);
  std::erase_if(days_, [&](const auto& day) {
    return std::ranges::find(files.days, day.first, &FolderFiles::Day::day) == files.days.end();
  });
  for (const FolderFiles::Day& file : files.days) {
    Day& day = days_[file.day];
    if (day.written == file.written && day.settled && !day.unread) continue;
    if (day.written != file.written) day.given_up = false;
    day.written = file.written;
    // A file clock that was set back makes the gateway read the file again, which does no harm.
    day.settled = fs::file_time_type::clock::now() - file.written > kStable;
    day.unread.reset();
    records::Database database((folder_ / DayFileName(file.day)).string(),
                               records::Database::Mode::read);
    records::Statement tables(database, "SELECT count(*) FROM sqlite_master");
    const bool is_new = database.is_open() && tables.Next() == Step::row && tables.Number(0) == 0;
    if (is_new && file.day == files.days.back().day) continue;  // the gateway is creating it
    std::map<std::int64_t, Run> runs;
    records::Statement rows(database, "SELECT run, began, until FROM runs");
    Step step = database.is_open() ? rows.Next() : Step::failed;
    for (; step == Step::row; step = rows.Next()) {
      runs[rows.Number(0)] = {rows.Number(0), rows.Number(1), rows.Number(2), {}};
    }
    if (step == Step::done) {
      day.runs = std::move(runs);
      continue;
    }
    std::error_code none;
    if (!fs::exists(folder_ / DayFileName(file.day), none)) {
      days_.erase(file.day);
      continue;
    }
    const std::string why = is_new ? "the file is empty: its content is lost" : database.error();
    day.unread =
        UnreadFile{file.day, DayFileName(file.day) + ": " + why, is_new || database.damaged()};
  }
}

const Run* KeptReader::Find(const Day& day, std::int64_t run) const {
  const auto found = day.runs.find(run);
  return day.given_up || found == day.runs.end() ? nullptr : &found->second;
}

std::optional<std::int64_t> KeptReader::RunAfter(std::int64_t run) const {
  std::optional<std::int64_t> next;
  for (const auto& [start, day] : days_) {
    if (day.given_up) continue;
    const auto found = day.runs.upper_bound(run);
    if (found != day.runs.end()) next = std::min(next.value_or(found->first), found->first);
  }
  return next;
}

std::optional<Millis> KeptReader::BeginOf(std::int64_t run) const {
  std::optional<Millis> begin;
  for (const auto& [start, day] : days_) {
    const Run* its = Find(day, run);
    if (its != nullptr) begin = std::min(begin.value_or(its->began), its->began);
  }
  return begin;
}

std::optional<Millis> KeptReader::EndOf(std::int64_t run) const {
  std::optional<Millis> end;
  for (const auto& [start, day] : days_) {
    const Run* its = Find(day, run);
    if (its != nullptr) end = std::max(end.value_or(its->until), its->until);
  }
  return end;
}

/// Returns the time up to which the file has all values of the run. The writer stores the values of
/// a run day by day, so a later file shows that an earlier file is complete.
Millis KeptReader::CompleteIn(Millis day, std::int64_t run, bool ended) const {
  const Millis end = day + kDay - 1;
  if (ended) return std::min(end, EndOf(run).value_or(end));
  Millis complete = std::numeric_limits<Millis>::min();
  for (auto at = days_.find(day); at != days_.end(); ++at) {
    const Run* its = Find(at->second, run);
    if (its != nullptr) complete = std::max(complete, its->until - kSettle);
  }
  return std::min(complete, end);
}

void KeptReader::Advance(StoredPart& part, std::int64_t next_run) {
  Pass& next = part.next;
  const Millis began = BeginOf(next_run).value_or(0);
  const std::optional<Millis> end = EndOf(next.run);
  const bool gone = next.run > 0 && (!end || *end < next.from || next_run > next.run + 1);
  if (gone && began - next.from > kLeastGap) {
    part.lost.push_back(
        {next.from + 1, began - 1, "files of the history were deleted or are damaged"});
  }
  const Millis spent = next.run == 0 ? 0 : std::max(end.value_or(0), next.from) + next.offset;
  next = {.run = next_run, .from = began - 1, .until = began - 1};
  next.offset = std::max<Millis>(0, spent + 1 - began);
}

/// Sets part.next to the next span. Returns false if there is none.
bool KeptReader::Plan(StoredPart& part) {
  Pass& next = part.next;
  for (;;) {
    const bool ended = RunAfter(next.run).has_value();
    const auto file = std::ranges::find_if(days_, [&](const auto& day) {
      const Run* its = Find(day.second, next.run);
      return its != nullptr && day.first + kDay - 1 > next.from &&
             (!ended || EndOf(next.run) > next.from);
    });
    const Millis begun = next.from + 1;
    const auto unread = std::ranges::find_if(days_, [&](const auto& day) {
      return day.second.unread && !day.second.given_up && day.first + kDay > begun &&
             (file == days_.end() || day.first < file->first);
    });
    if (unread != days_.end()) {
      part.unread = unread->second.unread;
      return false;
    }
    if (file == days_.end()) {
      if (!ended) return false;
      Advance(part, *RunAfter(next.run));
      continue;
    }
    if (FloorTo(begun, kDay) < file->first) {
      if (file->first - begun > kLeastGap) {
        part.lost.push_back({begun, file->first - 1,
                             DayFileName(FloorTo(begun, kDay)) + " was deleted or is damaged"});
      }
      next.from = next.until = file->first - 1;
    }
    const Millis complete = CompleteIn(file->first, next.run, ended);
    if (complete <= next.from) return false;
    next.until = std::min({complete, FloorTo(next.from + 1, kHour) + kHour - 1});
    next.point.clear();
    next.time = next.from;
    return true;
  }
}

StoredPart KeptReader::Read(const Pass& pass, std::size_t most) {
  StoredPart part{.next = pass};
  const bool goes_on = pass.in_span() && span_ && span_->Is(pass);
  if (!goes_on) {
    span_.reset();
    Look();
    const Pass newest = NewestPlace();
    const bool waits = std::ranges::any_of(
        days_, [](const auto& day) { return day.second.unread && !day.second.given_up; });
    if (newest.run > 0 && pass.run > newest.run && !waits) {
      part.next = newest;
      part.foreign = true;
      return part;
    }
    const auto file = days_.find(FloorTo(pass.from + 1, kDay));
    if (file != days_.end() && file->second.unread && !file->second.given_up) {
      part.unread = file->second.unread;
      return part;
    }
    // The rest of a span that a killed gateway had begun: its place is valid only for this span.
    const bool resumes =
        pass.in_span() && file != days_.end() && Find(file->second, pass.run) != nullptr;
    if (!resumes && pass.in_span()) part.next.until = part.next.from;
    if (!resumes && !Plan(part)) return part;
    const Millis its_day = FloorTo(part.next.from + 1, kDay);
    span_ = std::make_unique<Span>(folder_, its_day, part.next);
    if (!span_->Load(resumes)) {
      part.unread =
          UnreadFile{its_day, DayFileName(its_day) + ": " + span_->error(), span_->damaged()};
    } else {
      part.next.until = span_->until();
    }
  }
  part.more = true;
  if (!part.unread && !span_->Read(most, part)) {
    part.unread = UnreadFile{span_->day(), DayFileName(span_->day()) + ": " + span_->error(),
                             span_->damaged()};
  }
  if (part.unread || !part.next.in_span()) span_.reset();
  return part;
}

std::optional<Pass> KeptReader::Newest() {
  Look();
  const bool unread = !days_.empty() && days_.rbegin()->second.unread.has_value();
  return unread ? std::nullopt : std::optional(NewestPlace());
}

Pass KeptReader::NewestPlace() const {
  std::int64_t newest = 0;
  for (const auto& [start, day] : days_) {
    if (!day.given_up && !day.runs.empty()) newest = std::max(newest, day.runs.rbegin()->first);
  }
  if (newest == 0) return {};
  const Millis until = EndOf(newest).value_or(0) - kSettle;
  return {.run = newest, .from = until, .until = until};
}

void KeptReader::GiveUp(Millis day) {
  span_.reset();
  const auto found = days_.find(day);
  if (found == days_.end()) return;
  found->second.given_up = true;
}

}  // namespace baudgate::history
