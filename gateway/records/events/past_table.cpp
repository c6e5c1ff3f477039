// SPDX-License-Identifier: Apache-2.0
#include "gateway/records/events/past_table.h"

#include <algorithm>

namespace baudgate::events {

namespace {

/// Rows of one page: about 100 kB of the control socket.
constexpr std::size_t kPastPage = 1000;
constexpr const char* kAddPoint =
    "INSERT OR IGNORE INTO past_points (line, device, name) VALUES (?,?,?)";
constexpr const char* kFindPoint =
    "SELECT point FROM past_points WHERE line=? AND device=? AND name=?";
constexpr const char* kOfSeries =
    "SELECT point FROM past_points WHERE line=? AND device=? AND substr(name, 1, length(?3))=?3";
constexpr const char* kInsertPast =
    "INSERT INTO past (point, time, span, value, quality) VALUES (?,?,?,?,?)";
constexpr const char* kDropPast = "DELETE FROM past WHERE seq<=(SELECT max(seq) FROM past)-?";

constexpr std::int64_t Micros(Duration time) { return time / std::chrono::microseconds(1); }

}  // namespace

PastTable::PastTable(Database& database, std::int64_t most)
    : most_(most),
      add_point_(database, kAddPoint),
      find_point_(database, kFindPoint),
      of_series_(database, kOfSeries),
      insert_(database, kInsertPast),
      drop_(database, kDropPast) {}

std::optional<std::int64_t> PastTable::PointOf(const std::string& line, const std::string& device,
                                               const std::string& name) {
  if (!add_point_.Run(line, device, name)) return std::nullopt;
  find_point_.BindAll(line, device, name);
  const bool found = find_point_.Next() == Statement::Step::row;
  const auto point = found ? std::optional(find_point_.Number(0)) : std::nullopt;
  find_point_.Reset();
  return point;
}

bool PastTable::InsertRow(std::int64_t point, const PastRecord& record, const PastValue* value) {
  return insert_.Run(point, Micros(record.begin), Micros(record.span),
                     value == nullptr ? Value() : value->value,
                     value == nullptr ? Value() : Value(std::int64_t{value->quality.word()}));
}

bool PastTable::InsertGap(const std::string& line, const std::string& device,
                          const PastRecord& record) {
  std::vector<std::int64_t> points;
  of_series_.BindAll(line, device, record.series + ".");
  Statement::Step step = of_series_.Next();
  for (; step == Statement::Step::row; step = of_series_.Next()) {
    points.push_back(of_series_.Number(0));
  }
  of_series_.Reset();
  bool ok = step == Statement::Step::done;
  for (const std::int64_t point : points) ok = ok && InsertRow(point, record, nullptr);
  return ok;
}

bool PastTable::Insert(const std::string& line, const std::string& device,
                       const std::vector<PastRecord>& records) {
  for (const PastRecord& record : records) {
    if (record.values.empty() && !InsertGap(line, device, record)) return false;
    for (const PastValue& value : record.values) {
      const auto point = PointOf(line, device, record.series + "." + value.name);
      if (!point || !InsertRow(*point, record, &value)) return false;
    }
  }
  if (records.empty()) return true;
  return drop_.Run(most_);
}

namespace {

constexpr const char* kFind = "SELECT point FROM past_points WHERE line=? AND device=? AND name=?";
constexpr const char* kRows =
    "SELECT seq, time, span, value, quality FROM past WHERE point=?1 AND (time, seq)>(?2, ?3) AND "
    "time>=?4 AND time<?5 ORDER BY time, seq LIMIT ?6";

std::int64_t Micros(WallTime time) { return time.time_since_epoch() / 1us; }

PastRow RowOf(const Statement& row) {
  constexpr std::int64_t kLongest = 366LL * 24 * 3600 * 1'000'000;
  PastRow past;
  past.time = row.Time(1);
  past.span = std::clamp<std::int64_t>(row.Number(2), 0, kLongest) * 1us;
  past.value = row.At(3);
  if (!row.IsNull(4)) past.quality = Quality::OfWord(static_cast<std::uint16_t>(row.Number(4)));
  return past;
}

}  // namespace

Result<PastPage> ReadPast(Database& database, const PastQuery& query) {
  PastPage page;
  page.next = query.after;
  Statement find(database, kFind);
  find.BindAll(query.line, query.device, query.name);
  const Statement::Step found = find.Next();
  if (found == Statement::Step::failed) return Error{database.error()};
  if (found == Statement::Step::done) return page;
  page.known = true;
  Statement rows(database, kRows);
  rows.BindAll(find.Number(0), query.after.time, query.after.seq,
               query.since ? Micros(*query.since) : std::numeric_limits<std::int64_t>::min(),
               query.until ? Micros(*query.until) : std::numeric_limits<std::int64_t>::max(),
               static_cast<std::int64_t>(kPastPage + 1));
  while (true) {
    const Statement::Step step = rows.Next();
    if (step == Statement::Step::failed) return Error{database.error()};
    if (step == Statement::Step::done) return page;
    page.more = page.rows.size() == kPastPage;
    if (page.more) return page;
    page.rows.push_back(RowOf(rows));
    page.next = {rows.Number(0), rows.Number(1)};
  }
}

Result<PastPage> ReadPast(const std::filesystem::path& file, const PastQuery& query,
                          bool* damaged) {
  return ReadOnce(file, damaged, [&](Database& database) { return ReadPast(database, query); });
}

}  // namespace baudgate::events
