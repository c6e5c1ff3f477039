// SPDX-License-Identifier: Apache-2.0
#include "gateway/records/events/event_source.h"

#include <algorithm>
#include <limits>
#include <utility>

#include "gateway/base/text.h"

namespace baudgate::events {
namespace {

constexpr std::string_view kEventColumns =
    "SELECT seq, receive_time, device_time, clock_quality, line, device, channel, code, state, "
    "text, priority FROM events ";

std::uint32_t CodeOf(std::int64_t number) {
  return static_cast<std::uint32_t>(
      std::clamp<std::int64_t>(number, 0, std::numeric_limits<std::uint32_t>::max()));
}

config::EventState EventStateNamed(std::string_view name) {
  for (std::size_t i = 0; i < config::kEventStates; ++i) {
    const auto state = static_cast<config::EventState>(i);
    if (config::Name(state) == name) return state;
  }
  return config::EventState::message;
}

config::AlarmPriority EventPriorityNamed(std::string_view name) {
  const auto found = std::ranges::find(kEventPriorities, name);
  return found == kEventPriorities.end()
             ? config::AlarmPriority::none
             : static_cast<config::AlarmPriority>(found - kEventPriorities.begin());
}

EventRecord RecordOf(const records::Statement& row) {
  EventRecord record;
  record.seq = row.Number(0);
  record.received = row.Time(1);
  record.device_time = row.Time(2);
  record.clock = ClockQualityOf(row.Number(3));
  record.line = std::string(row.Text(4));
  record.device = std::string(row.Text(5));
  record.channel = CodeOf(row.Number(6));
  record.code = CodeOf(row.Number(7));
  record.state = EventStateNamed(row.Text(8));
  record.text = std::string(row.Text(9)).substr(0, kLongestText);
  record.mark.priority = EventPriorityNamed(row.Text(10));
  return record;
}

bool AddKept(records::Database& database, Page& page) {
  auto kept = ReadRecordsOf(database, page.records.front().seq, page.records.back().seq);
  if (!kept) return false;
  auto record = page.records.begin();
  std::size_t values = 0;
  for (KeptRecord& one : *kept) {
    while (record != page.records.end() && record->seq < one.event) ++record;
    if (record == page.records.end()) return true;
    if (record->seq != one.event) continue;
    values += one.values.size();
    record->record = one.name;
    record->kept = std::move(one);
    if (values < kPageValues || record + 1 == page.records.end()) continue;
    page.records.erase(record + 1, page.records.end());
    page.next = page.records.back().seq;
    return page.more = true;
  }
  return true;
}

/// Adds the records of the events to a page. A page with many values ends after the event with
/// which the number of values reaches kPageValues.
bool AddRecords(records::Database& database, Page& page) {
  if (page.records.empty()) return true;
  if (!AddKept(database, page)) return false;
  records::Statement owed(database,
                          "SELECT event, name FROM owed_records WHERE event>=? AND event<=?");
  owed.BindAll(page.records.front().seq, page.records.back().seq);
  records::Statement::Step step = owed.Next();
  for (; step == records::Statement::Step::row; step = owed.Next()) {
    const auto found = std::ranges::find(page.records, owed.Number(0), &EventRecord::seq);
    if (found != page.records.end()) found->record = std::string(owed.Text(1));
  }
  return step == records::Statement::Step::done;
}

}  // namespace

Result<Page> ReadPage(records::Database& database, const PageQuery& query) {
  std::string sql(kEventColumns);
  sql += "WHERE seq>?1";
  if (query.since) sql += " AND receive_time>=?2";
  if (!query.line.empty()) sql += " AND line=?3";
  if (!query.device.empty()) sql += " AND device=?4";
  if (query.until) sql += " AND receive_time<?5";
  if (query.state) sql += " AND state=?6";
  if (!query.text.empty()) sql += " AND instr(lower(text), ?7)>0";
  if (query.priority) sql += " AND priority=?8";
  sql += " ORDER BY seq LIMIT " + std::to_string(kPage + 1);
  records::Statement rows(database, sql);
  rows.BindAll(query.after, query.since);
  if (!query.line.empty()) rows.Bind(3, query.line);
  if (!query.device.empty()) rows.Bind(4, query.device);
  if (query.until) rows.Bind(5, *query.until);
  if (query.state) rows.Bind(6, std::string(config::Name(*query.state)));
  if (!query.text.empty()) rows.Bind(7, Lower(query.text));
  if (query.priority) {
    rows.Bind(8, kEventPriorities[static_cast<std::size_t>(*query.priority)]);
  }
  Page page;
  page.next = query.after;
  for (;;) {
    const records::Statement::Step step = rows.Next();
    if (step == records::Statement::Step::failed) return Error{database.error()};
    page.more = step == records::Statement::Step::row && page.records.size() == kPage;
    if (step == records::Statement::Step::done || page.more) break;
    page.records.push_back(RecordOf(rows));
    page.next = page.records.back().seq;
  }
  return page;
}

Result<Page> ReadPage(const std::filesystem::path& file, const PageQuery& query, bool* damaged) {
  return records::ReadOnce(file, damaged, [&](records::Database& database) -> Result<Page> {
    auto page = ReadPage(database, query);
    if (page && !AddRecords(database, *page)) return Error{database.error()};
    return page;
  });
}

}  // namespace baudgate::events
