// SPDX-License-Identifier: Apache-2.0
#include "gateway/records/events/record_page.h"

#include <algorithm>

#include "gateway/records/disk/read_once.h"

namespace baudgate::events {
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

KeptRecord RecordOf(const Statement& row) {
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
  explicit Values(Database& database) : rows_(database, kValues) {}

  bool Read(KeptRecord& record) {
    rows_.Bind(1, record.kind);
    rows_.Bind(2, record.seq);
    Statement::Step step = rows_.Next();
    for (; step == Statement::Step::row; step = rows_.Next()) {
      const auto word =
          static_cast<std::uint16_t>(std::clamp<std::int64_t>(rows_.Number(3), 0, 0xFFFF));
      record.values.push_back({std::string(rows_.Text(0)), rows_.At(1), std::string(rows_.Text(2)),
                               Quality::OfWord(word)});
    }
    rows_.Reset();
    return step == Statement::Step::done;
  }

 private:
  Statement rows_;
};

void BindAll(Statement& rows, const RecordQuery& query) {
  rows.Bind(1, query.kind);
  rows.Bind(2, query.after);
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

Result<RecordPage> ReadRecords(Database& database, const RecordQuery& query) {
  std::string sql(kRecordColumns);
  sql += "WHERE kind=?1 AND seq>?2";
  if (!query.line.empty()) sql += " AND line=?3";
  if (!query.device.empty()) sql += " AND device=?4";
  if (!query.name.empty()) sql += " AND name=?5";
  if (query.since) sql += " AND device_time>=?6";
  if (query.until) sql += " AND device_time<?7";
  sql += " ORDER BY seq LIMIT " + std::to_string(kRecordPage + 1);
  Statement rows(database, sql);
  BindAll(rows, query);
  Values values(database);
  RecordPage page;
  page.next = query.after;
  std::size_t count = 0;
  for (;;) {
    const Statement::Step step = rows.Next();
    if (step == Statement::Step::failed) return Error{database.error()};
    if (step == Statement::Step::done) return page;
    page.more = page.records.size() == kRecordPage || count >= kPageValues;
    if (page.more) return page;
    KeptRecord record = RecordOf(rows);
    if (!values.Read(record)) return Error{database.error()};
    count += record.values.size();
    page.next = record.seq;
    page.records.push_back(std::move(record));
  }
}

Result<RecordPage> ReadRecords(const std::filesystem::path& file, const RecordQuery& query) {
  return ReadOnce(file, nullptr, [&](Database& database) { return ReadRecords(database, query); });
}

Result<std::vector<KeptRecord>> ReadRecordsOf(Database& database, std::int64_t first,
                                              std::int64_t last) {
  std::vector<KeptRecord> records;
  Statement rows(database,
                 std::string(kRecordColumns) +
                     "WHERE kind='event' AND event>0 AND event>=? AND event<=? ORDER BY event");
  rows.Bind(1, first);
  rows.Bind(2, last);
  Values values(database);
  for (;;) {
    const Statement::Step step = rows.Next();
    if (step == Statement::Step::failed) return Error{database.error()};
    if (step == Statement::Step::done) return records;
    KeptRecord record = RecordOf(rows);
    if (!values.Read(record)) return Error{database.error()};
    records.push_back(std::move(record));
  }
}

}  // namespace baudgate::events
