// SPDX-License-Identifier: Apache-2.0
#include "gateway/events/event_page.h"

#include <algorithm>
#include <limits>

namespace baudgate::events {
namespace {

constexpr std::string_view kColumns =
    "SELECT seq, receive_time, device_time, clock_quality, line, device, channel, code, state, "
    "text FROM events ";

std::uint32_t CodeOf(std::int64_t number) {
  return static_cast<std::uint32_t>(
      std::clamp<std::int64_t>(number, 0, std::numeric_limits<std::uint32_t>::max()));
}

config::EventState StateNamed(std::string_view name) {
  for (std::size_t i = 0; i < config::kEventStates; ++i) {
    const auto state = static_cast<config::EventState>(i);
    if (config::Name(state) == name) return state;
  }
  return config::EventState::message;
}

EventRecord RecordOf(const Statement& row) {
  EventRecord record;
  record.seq = row.Number(0);
  record.received = row.Time(1);
  record.device_time = row.Time(2);
  const std::int64_t clock = row.Number(3);
  const bool known = clock >= 0 && clock < static_cast<std::int64_t>(kClockQualities);
  record.clock = known ? static_cast<ClockQuality>(clock) : ClockQuality::none;
  record.line = std::string(row.Text(4));
  record.device = std::string(row.Text(5));
  record.channel = CodeOf(row.Number(6));
  record.code = CodeOf(row.Number(7));
  record.state = StateNamed(row.Text(8));
  record.text = std::string(row.Text(9)).substr(0, kLongestText);
  return record;
}

}  // namespace

Result<Page> ReadPage(Database& database, const PageQuery& query) {
  std::string sql(kColumns);
  sql += "WHERE seq>?1";
  if (query.since) sql += " AND receive_time>=?2";
  if (!query.line.empty()) sql += " AND line=?3";
  if (!query.device.empty()) sql += " AND device=?4";
  sql += " ORDER BY seq LIMIT " + std::to_string(kPage + 1);
  Statement rows(database, sql);
  rows.Bind(1, query.after);
  if (query.since) rows.Bind(2, *query.since);
  if (!query.line.empty()) rows.Bind(3, query.line);
  if (!query.device.empty()) rows.Bind(4, query.device);
  Page page;
  page.next = query.after;
  for (;;) {
    const Statement::Step step = rows.Next();
    if (step == Statement::Step::failed) return Error{database.error()};
    if (step == Statement::Step::done) return page;
    page.more = page.records.size() == kPage;
    if (page.more) return page;
    page.records.push_back(RecordOf(rows));
    page.next = page.records.back().seq;
  }
}

Result<Page> ReadPage(const std::filesystem::path& file, const PageQuery& query) {
  Database database(file.string(), Database::Mode::read);
  if (!database.is_open()) return Error{file.string() + ": " + database.error()};
  auto page = ReadPage(database, query);
  if (!page) return Error{file.string() + ": " + page.error()};
  return page;
}

}  // namespace baudgate::events
