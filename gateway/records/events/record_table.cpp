// SPDX-License-Identifier: Apache-2.0
#include "gateway/records/events/record_table.h"

#include <algorithm>

namespace baudgate::events {
namespace {

constexpr const char* kFindRecord =
    "SELECT coalesce((SELECT max(seq) FROM records WHERE kind=?1), 0), EXISTS (SELECT 1 FROM "
    "records WHERE kind=?1 AND line=?2 AND device=?3 AND name=?4 AND device_time=?5 AND event=?6)";
constexpr const char* kInsertRecord =
    "INSERT INTO records (kind, seq, line, device, name, event, device_time, clock_quality, "
    "read_time, state, text) VALUES (?,?,?,?,?,?,?,?,?,?,?)";
constexpr const char* kValue =
    "INSERT INTO record_values (kind, seq, ordinal, name, value, unit, quality) VALUES "
    "(?,?,?,?,?,?,?)";
constexpr const char* kOwe =
    "INSERT OR REPLACE INTO owed_records (event, line, device, name, device_time, clock_quality) "
    "VALUES (?,?,?,?,?,?)";
constexpr const char* kSettle = "DELETE FROM owed_records WHERE event=?";
constexpr const char* kDropValues =
    "DELETE FROM record_values WHERE kind='event' AND seq IN (SELECT seq FROM records WHERE "
    "kind='event' AND event>0 AND event<=?)";
constexpr const char* kDropRecords =
    "DELETE FROM records WHERE kind='event' AND event>0 AND event<=?";
constexpr const char* kDropOldValues = "DELETE FROM record_values WHERE kind=? AND seq<=?";
constexpr const char* kDropOld = "DELETE FROM records WHERE kind=? AND seq<=?";
constexpr const char* kDropOwed = "DELETE FROM owed_records WHERE event<=?";

std::int64_t NumberOf(ClockQuality clock) { return static_cast<std::uint16_t>(clock); }

}  // namespace

RecordTable::RecordTable(records::Database& database, std::int64_t most)
    : database_(database),
      most_(most),
      find_(database, kFindRecord),
      insert_(database, kInsertRecord),
      value_(database, kValue),
      owe_(database, kOwe),
      settle_(database, kSettle),
      drop_values_(database, kDropValues),
      drop_(database, kDropRecords),
      drop_old_values_(database, kDropOldValues),
      drop_old_(database, kDropOld),
      drop_owed_(database, kDropOwed) {}

bool RecordTable::Insert(const KeptRecord& record) {
  find_.BindAll(record.kind, record.line, record.device, record.name, record.device_time,
                record.event);
  if (find_.Next() != records::Statement::Step::row) return false;
  const std::int64_t seq = find_.Number(0) + 1;
  const bool known = find_.Number(1) != 0;
  find_.Reset();
  if (record.event != 0) {
    if (!settle_.Run(record.event)) return false;
  }
  if (known) return true;
  return insert_.Run(record.kind, seq, record.line, record.device, record.name, record.event,
                     record.device_time, NumberOf(record.clock), record.read, Name(record.state),
                     record.text) &&
         InsertValues(record, seq);
}

/// Inserts the values of a record, and deletes the oldest records beyond the limit of the kind. The
/// limit does not apply to records of events.
bool RecordTable::InsertValues(const KeptRecord& record, std::int64_t seq) {
  std::int64_t ordinal = 0;
  for (const RecordValue& value : record.values) {
    const bool ok = value_.Run(record.kind, seq, ordinal++, value.name, value.value, value.unit,
                               std::int64_t{value.quality.word()});
    if (!ok) return false;
  }
  if (record.kind == kEventRecord) return true;
  for (records::Statement* drop : {&drop_old_values_, &drop_old_}) {
    if (!drop->Run(record.kind, seq - most_)) return false;
  }
  return true;
}

bool RecordTable::Owe(const OwedRecord& owed) {
  return owe_.Run(owed.event, owed.line, owed.device, owed.name, owed.device_time,
                  NumberOf(owed.clock));
}

bool RecordTable::Drop(std::int64_t event) {
  for (records::Statement* drop : {&drop_values_, &drop_, &drop_owed_}) {
    if (!drop->Run(event)) return false;
  }
  return true;
}

bool RecordTable::ReadOwed(std::vector<OwedRecord>& owed) {
  records::Statement rows(
      database_,
      "SELECT event, line, device, name, device_time, clock_quality FROM owed_records "
      "ORDER BY event");
  records::Statement::Step step = rows.Next();
  for (; step == records::Statement::Step::row; step = rows.Next()) {
    owed.push_back({rows.Number(0), std::string(rows.Text(1)), std::string(rows.Text(2)),
                    std::string(rows.Text(3)), rows.Time(4), ClockQualityOf(rows.Number(5))});
  }
  return step == records::Statement::Step::done;
}

namespace {

constexpr std::string_view kRecordColumns =
    "SELECT kind, seq, line, device, name, event, device_time, clock_quality, read_time, state, "
    "text FROM records ";
constexpr std::string_view kValues =
    "SELECT name, value, unit, quality FROM record_values WHERE kind=? AND seq=? ORDER BY ordinal";

RecordState RecordStateNamed(std::string_view name) {
  for (std::size_t i = 0; i < kRecordStates; ++i) {
    const auto state = static_cast<RecordState>(i);
    if (Name(state) == name) return state;
  }
  return RecordState::not_read;
}

KeptRecord KeptRecordOf(const records::Statement& row) {
  KeptRecord record;
  record.kind = std::string(row.Text(0));
  record.seq = row.Number(1);
  record.line = std::string(row.Text(2));
  record.device = std::string(row.Text(3));
  record.name = std::string(row.Text(4));
  record.event = row.Number(5);
  record.device_time = row.Time(6);
  record.clock = ClockQualityOf(row.Number(7));
  record.read = row.Time(8);
  record.state = RecordStateNamed(row.Text(9));
  record.text = std::string(row.Text(10));
  return record;
}

class Values {
 public:
  explicit Values(records::Database& database) : rows_(database, kValues) {}

  bool Read(KeptRecord& record) {
    rows_.BindAll(record.kind, record.seq);
    records::Statement::Step step = rows_.Next();
    for (; step == records::Statement::Step::row; step = rows_.Next()) {
      const auto word =
          static_cast<std::uint16_t>(std::clamp<std::int64_t>(rows_.Number(3), 0, 0xFFFF));
      record.values.push_back({std::string(rows_.Text(0)), rows_.At(1), std::string(rows_.Text(2)),
                               Quality::OfWord(word)});
    }
    rows_.Reset();
    return step == records::Statement::Step::done;
  }

 private:
  records::Statement rows_;
};

void BindAll(records::Statement& rows, const RecordQuery& query) {
  rows.BindAll(query.kind, query.after);
  if (!query.line.empty()) rows.Bind(3, query.line);
  if (!query.device.empty()) rows.Bind(4, query.device);
  if (!query.name.empty()) rows.Bind(5, query.name);
  if (query.since) rows.Bind(6, *query.since);
  if (query.until) rows.Bind(7, *query.until);
}

}  // namespace

std::string_view Name(RecordState state) {
  switch (state) {
    case RecordState::read:
      return "read";
    case RecordState::not_read:
      return "not read";
    case RecordState::superseded:
      return "superseded";
  }
  return "";
}

Result<RecordPage> ReadRecords(records::Database& database, const RecordQuery& query) {
  std::string sql(kRecordColumns);
  sql += "WHERE kind=?1 AND seq>?2";
  if (!query.line.empty()) sql += " AND line=?3";
  if (!query.device.empty()) sql += " AND device=?4";
  if (!query.name.empty()) sql += " AND name=?5";
  if (query.since) sql += " AND device_time>=?6";
  if (query.until) sql += " AND device_time<?7";
  sql += " ORDER BY seq LIMIT " + std::to_string(kRecordPage + 1);
  records::Statement rows(database, sql);
  BindAll(rows, query);
  Values values(database);
  RecordPage page;
  page.next = query.after;
  std::size_t count = 0;
  for (;;) {
    const records::Statement::Step step = rows.Next();
    if (step == records::Statement::Step::failed) return Error{database.error()};
    if (step == records::Statement::Step::done) return page;
    page.more = page.records.size() == kRecordPage || count >= kPageValues;
    if (page.more) return page;
    KeptRecord record = KeptRecordOf(rows);
    if (!values.Read(record)) return Error{database.error()};
    count += record.values.size();
    page.next = record.seq;
    page.records.push_back(std::move(record));
  }
}

Result<RecordPage> ReadRecords(const std::filesystem::path& file, const RecordQuery& query) {
  return records::ReadOnce(
      file, nullptr, [&](records::Database& database) { return ReadRecords(database, query); });
}

Result<std::vector<KeptRecord>> ReadRecordsOf(records::Database& database, std::int64_t first,
                                              std::int64_t last) {
  std::vector<KeptRecord> records;
  records::Statement rows(
      database, std::string(kRecordColumns) +
                    "WHERE kind='event' AND event>0 AND event>=? AND event<=? ORDER BY event");
  rows.BindAll(first, last);
  Values values(database);
  for (;;) {
    const records::Statement::Step step = rows.Next();
    if (step == records::Statement::Step::failed) return Error{database.error()};
    if (step == records::Statement::Step::done) return records;
    KeptRecord record = KeptRecordOf(rows);
    if (!values.Read(record)) return Error{database.error()};
    records.push_back(std::move(record));
  }
}

namespace {

/// The limit of rows in one page: about 100 kB on the control socket.
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

PastTable::PastTable(records::Database& database, std::int64_t most)
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
  const bool found = find_point_.Next() == records::Statement::Step::row;
  const auto point = found ? std::optional(find_point_.Number(0)) : std::nullopt;
  find_point_.Reset();
  return point;
}

bool PastTable::InsertRow(std::int64_t point, const protocols::PastRecord& record,
                          const protocols::PastValue* value) {
  return insert_.Run(point, Micros(record.begin), Micros(record.span),
                     value == nullptr ? Value() : value->value,
                     value == nullptr ? Value() : Value(std::int64_t{value->quality.word()}));
}

bool PastTable::InsertGap(const std::string& line, const std::string& device,
                          const protocols::PastRecord& record) {
  std::vector<std::int64_t> points;
  of_series_.BindAll(line, device, record.series + ".");
  records::Statement::Step step = of_series_.Next();
  for (; step == records::Statement::Step::row; step = of_series_.Next()) {
    points.push_back(of_series_.Number(0));
  }
  of_series_.Reset();
  bool ok = step == records::Statement::Step::done;
  for (const std::int64_t point : points) ok = ok && InsertRow(point, record, nullptr);
  return ok;
}

bool PastTable::Insert(const std::string& line, const std::string& device,
                       const std::vector<protocols::PastRecord>& records) {
  for (const protocols::PastRecord& record : records) {
    if (record.values.empty() && !InsertGap(line, device, record)) return false;
    for (const protocols::PastValue& value : record.values) {
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

PastRow RowOf(const records::Statement& row) {
  constexpr std::int64_t kLongest = 366LL * 24 * 3600 * 1'000'000;
  PastRow past;
  past.time = row.Time(1);
  past.span = std::clamp<std::int64_t>(row.Number(2), 0, kLongest) * 1us;
  past.value = row.At(3);
  if (!row.IsNull(4)) past.quality = Quality::OfWord(static_cast<std::uint16_t>(row.Number(4)));
  return past;
}

}  // namespace

Result<PastPage> ReadPast(records::Database& database, const PastQuery& query) {
  PastPage page;
  page.next = query.after;
  records::Statement find(database, kFind);
  find.BindAll(query.line, query.device, query.name);
  const records::Statement::Step found = find.Next();
  if (found == records::Statement::Step::failed) return Error{database.error()};
  if (found == records::Statement::Step::done) return page;
  page.known = true;
  records::Statement rows(database, kRows);
  rows.BindAll(find.Number(0), query.after.time, query.after.seq,
               query.since ? Micros(*query.since) : std::numeric_limits<std::int64_t>::min(),
               query.until ? Micros(*query.until) : std::numeric_limits<std::int64_t>::max(),
               static_cast<std::int64_t>(kPastPage + 1));
  while (true) {
    const records::Statement::Step step = rows.Next();
    if (step == records::Statement::Step::failed) return Error{database.error()};
    if (step == records::Statement::Step::done) return page;
    page.more = page.rows.size() == kPastPage;
    if (page.more) return page;
    page.rows.push_back(RowOf(rows));
    page.next = {rows.Number(0), rows.Number(1)};
  }
}

Result<PastPage> ReadPast(const std::filesystem::path& file, const PastQuery& query,
                          bool* damaged) {
  return records::ReadOnce(file, damaged,
                           [&](records::Database& database) { return ReadPast(database, query); });
}

}  // namespace baudgate::events
