// SPDX-License-Identifier: Apache-2.0
#include "gateway/records/events/event_file.h"

#include <algorithm>
#include <iterator>
#include <utility>

#include "gateway/records/events/event_record.h"
#include "gateway/records/events/event_source.h"

namespace baudgate::events {
namespace {

/// Returns the state with this name. An unknown name gives `active`: the file can contain anything,
/// and a wrong alarm is better than a lost one.
AlarmState AlarmStateNamed(std::string_view name) {
  for (const AlarmState state : {AlarmState::acknowledged, AlarmState::returned}) {
    if (Name(state) == name) return state;
  }
  return AlarmState::active;
}

config::AlarmPriority PriorityNamed(std::string_view name) {
  for (const auto priority : {config::AlarmPriority::low, config::AlarmPriority::high}) {
    if (Name(priority) == name) return priority;
  }
  return config::AlarmPriority::medium;
}

}  // namespace

AlarmTable::AlarmTable(records::Database& database)
    : database_(database),
      write_(database,
             "INSERT OR REPLACE INTO alarms (line, device, name, point, state, priority, seq, "
             "raised, changed, text, acknowledged_by) VALUES (?,?,?,?,?,?,?,?,?,?,?)"),
      remove_(database, "DELETE FROM alarms WHERE line=? AND device=? AND name=?") {}

bool AlarmTable::Read(std::vector<Alarm>& alarms) {
  records::Statement rows(
      database_,
      "SELECT line, device, name, point, state, priority, seq, raised, changed, text, "
      "acknowledged_by FROM alarms");
  records::Statement::Step step = rows.Next();
  for (; step == records::Statement::Step::row; step = rows.Next()) {
    Alarm& alarm = alarms.emplace_back();
    alarm.line = std::string(rows.Text(0));
    alarm.device = std::string(rows.Text(1));
    alarm.name = std::string(rows.Text(2));
    alarm.point = std::string(rows.Text(3));
    alarm.state = AlarmStateNamed(rows.Text(4));
    alarm.priority = PriorityNamed(rows.Text(5));
    alarm.seq = rows.Number(6);
    alarm.raised = rows.Time(7);
    alarm.changed = rows.Time(8);
    alarm.text = std::string(rows.Text(9));
    Shorten(alarm.text);
    alarm.by = std::string(rows.Text(10));
  }
  return step == records::Statement::Step::done;
}

bool AlarmTable::Write(const Alarm& alarm) {
  if (alarm.state == AlarmState::normal) {
    return remove_.Run(alarm.line, alarm.device, alarm.name);
  }
  return write_.Run(alarm.line, alarm.device, alarm.name, alarm.point, Name(alarm.state),
                    Name(alarm.priority), alarm.seq, alarm.raised, alarm.changed, alarm.text,
                    alarm.by);
}

namespace {

constexpr const char* kInsertEvent =
    "INSERT INTO events (seq, receive_time, device_time, clock_quality, line, device, channel, "
    "code, state, text, priority) VALUES (?,?,?,?,?,?,?,?,?,?,?)";
constexpr const char* kSaid =
    "INSERT INTO event_sources (line, device, said) VALUES (?,?,?) ON CONFLICT (line, device) DO "
    "UPDATE SET said=excluded.said";
constexpr const char* kDropEvents =
    "DELETE FROM events WHERE seq IN (SELECT seq FROM events WHERE seq<=? ORDER BY seq LIMIT 1000)";
constexpr const char* kCursor = "INSERT INTO event_cursors (name, seq, sure) VALUES (?,?,?)";
constexpr const char* kGone = "SELECT seq, device FROM events WHERE seq>? AND seq<=? ORDER BY seq";
/// Finds the newest event of each device. Needs one index look-up for each device, however many
/// events the file contains.
constexpr const char* kOlder =
    "WITH RECURSIVE its(device) AS (SELECT min(device) FROM events UNION ALL SELECT (SELECT "
    "min(device) FROM events WHERE device>its.device) FROM its WHERE its.device IS NOT NULL) "
    "SELECT device, (SELECT max(seq) FROM events WHERE device=its.device AND seq<=?) FROM its "
    "WHERE device IS NOT NULL";

}  // namespace

EventTable::EventTable(records::Database& database, std::int64_t most)
    : database_(database),
      most_(most),
      insert_(database, kInsertEvent),
      said_(database, kSaid),
      drop_(database, kDropEvents),
      cursor_(database, kCursor),
      alarms_(database),
      records_(database),
      past_(database) {}

EventTable::Contents EventTable::Read(FeedLimits limits) {
  Contents contents;
  const Value last = database_.First("SELECT coalesce(max(seq), 0) FROM events");
  if (!std::holds_alternative<std::int64_t>(last)) return contents;
  contents.last = std::get<std::int64_t>(last);
  if (!ReadRun(contents) || !alarms_.Read(contents.alarms) || !ReadCursors(contents.cursors) ||
      !records_.ReadOwed(contents.owed) || !FindOldest()) {
    return contents;
  }
  records::Statement rows(database_, "SELECT line, device, said FROM event_sources");
  records::Statement::Step step = rows.Next();
  for (; step == records::Statement::Step::row; step = rows.Next()) {
    contents.said[{std::string(rows.Text(0)), std::string(rows.Text(1))}] = rows.Text(2);
  }
  contents.image.newest = contents.last;
  contents.image.alarms = contents.alarms;
  contents.ok = step == records::Statement::Step::done && ReadImage(limits, contents.image);
  return contents;
}

bool EventTable::ReadImage(FeedLimits limits, FeedImage& image) {
  const std::int64_t gone =
      std::max<std::int64_t>(0, image.newest - static_cast<std::int64_t>(limits.events));
  const std::int64_t older =
      std::max<std::int64_t>(0, gone - static_cast<std::int64_t>(limits.remembered));
  for (std::int64_t after = gone;;) {
    auto events = ReadBehind(after);
    if (!events) return false;
    if (events->empty()) break;
    after = events->back().seq;
    std::ranges::move(*events, std::back_inserter(image.events));
  }
  records::Statement rows(database_, kGone);
  rows.BindAll(older, gone);
  records::Statement::Step step = rows.Next();
  for (; step == records::Statement::Step::row; step = rows.Next()) {
    image.gone.push_back({rows.Number(0), std::string(rows.Text(1))});
  }
  if (step == records::Statement::Step::failed) return false;
  records::Statement newest(database_, kOlder);
  newest.Bind(1, older);
  for (step = newest.Next(); step == records::Statement::Step::row; step = newest.Next()) {
    if (!newest.IsNull(1)) image.older[std::string(newest.Text(0))] = newest.Number(1);
  }
  return step == records::Statement::Step::done;
}

bool EventTable::ReadRun(Contents& contents) {
  records::Statement run(
      database_,
      "SELECT code, (SELECT receive_time FROM events ORDER BY seq DESC LIMIT 1) FROM "
      "events WHERE device='' AND code IN (?,?) ORDER BY seq DESC LIMIT 1");
  run.BindAll(std::int64_t{CodeOf(OwnCode::started)}, std::int64_t{CodeOf(OwnCode::stops)});
  const records::Statement::Step step = run.Next();
  if (step == records::Statement::Step::row) {
    const bool ended = run.Number(0) == std::int64_t{CodeOf(OwnCode::stops)};
    contents.last_run = {ended ? LastRun::End::in_order : LastRun::End::broken_off, run.Time(1)};
  }
  return step != records::Statement::Step::failed;
}

bool EventTable::ReadCursors(Cursors& cursors) {
  records::Statement rows(database_, "SELECT name, seq, sure FROM event_cursors");
  records::Statement::Step step = rows.Next();
  for (; step == records::Statement::Step::row; step = rows.Next()) {
    cursors[std::string(rows.Text(0))] = {rows.Number(1), rows.Number(2) != 0};
  }
  return step == records::Statement::Step::done;
}

bool EventTable::WriteCursors(const Cursors& cursors) {
  bool ok = database_.Execute("DELETE FROM event_cursors");
  for (const auto& [name, cursor] : cursors) {
    ok = ok && cursor_.Run(name, cursor.seq, std::int64_t{cursor.sure ? 1 : 0});
  }
  return ok;
}

Result<std::vector<EventRecord>> EventTable::ReadBehind(std::int64_t after) {
  auto page = ReadPage(database_, {.after = after});
  if (!page) return Error{page.error()};
  return std::move(page->records);
}

bool EventTable::Write(const std::vector<Batch>& batches, const Cursors* cursors,
                       const std::vector<KeptRecord>& records) {
  bool ok = database_.Execute("BEGIN IMMEDIATE");
  for (const Batch& batch : batches) ok = ok && Insert(batch);
  for (const KeptRecord& record : records) ok = ok && records_.Insert(record);
  ok = ok && (cursors == nullptr || WriteCursors(*cursors));
  ok = ok && database_.Execute("COMMIT");
  if (!ok) database_.Rollback();
  return ok;
}

bool EventTable::WriteAlarms(const std::vector<Alarm>& alarms) {
  bool ok = database_.Execute("BEGIN IMMEDIATE; DELETE FROM alarms;");
  for (const Alarm& alarm : alarms) ok = ok && alarms_.Write(alarm);
  ok = ok && database_.Execute("COMMIT");
  if (!ok) database_.Rollback();
  return ok;
}

/// Inserts a batch, and deletes events beyond the limit: at most 1000 at a time, and never the
/// newest.
bool EventTable::Insert(const Batch& batch) {
  for (const EventRecord& event : batch.events) {
    insert_.BindAll(event.seq, event.received, event.device_time,
                    std::int64_t{static_cast<std::uint16_t>(event.clock)}, event.line, event.device,
                    std::int64_t{event.channel}, std::int64_t{event.code}, Name(event.state),
                    event.text, kEventPriorities[static_cast<std::size_t>(PriorityOf(event))]);
    if (!insert_.Run() || (event.alarm && !alarms_.Write(*event.alarm))) return false;
    if (!InsertRecord(event)) return false;
  }
  if (batch.events.empty() && batch.past.empty()) return true;
  if (batch.source != kGateway) {
    said_.BindAll(batch.line, batch.device, batch.said);
    if (!said_.Run() || !past_.Insert(batch.line, batch.device, batch.past)) return false;
  }
  return batch.events.empty() || Drop(batch.events.back().seq);
}

bool EventTable::InsertRecord(const EventRecord& event) {
  if (event.record.empty()) return true;
  if (!event.kept) {
    return records_.Owe(
        {event.seq, event.line, event.device, event.record, event.device_time, event.clock});
  }
  KeptRecord record = *event.kept;
  record.kind = kEventRecord;
  record.event = event.seq;
  return records_.Insert(record);
}

bool EventTable::Drop(std::int64_t newest) {
  const std::int64_t beyond = newest - most_;
  if (oldest_ > 0 && beyond < oldest_) return true;
  return drop_.Run(beyond) && records_.Drop(beyond) && FindOldest();
}

bool EventTable::FindOldest() {
  const Value oldest = database_.First("SELECT coalesce(min(seq), 0) FROM events");
  if (!std::holds_alternative<std::int64_t>(oldest)) return false;
  oldest_ = std::get<std::int64_t>(oldest);
  return true;
}

EventFile::EventFile(std::filesystem::path path, std::string vfs,
                     std::shared_ptr<records::EventsWriter> writer)
    : connection_(std::move(path), std::move(vfs), std::move(writer)) {}

std::optional<EventFile::Opened> EventFile::Open() {
  if (table_) return std::nullopt;
  Opened opened{connection_.Open(), {}};
  if (!opened.ok) return opened;
  table_.emplace(connection_.database());
  opened.contents = table_->Read();
  opened.ok = opened.contents.ok;
  if (opened.ok) {
    lacks_alarms_ = std::exchange(was_open_, true);
    return opened;
  }
  table_.reset();
  opened.error = connection_.Failed().message;
  connection_.Close();
  return opened;
}

Status EventFile::Write(const std::vector<Batch>& batches, const Cursors* cursors,
                        const std::vector<KeptRecord>& records) {
  Status status = connection_.Check();
  const bool due = !batches.empty() || cursors != nullptr || !records.empty();
  if (status && due && !table_->Write(batches, cursors, records)) status = connection_.Failed();
  if (!connection_.is_open()) table_.reset();
  return status;
}

Status EventFile::Check() {
  Status status = connection_.Check(true);
  if (!status) table_.reset();
  return status;
}

Result<std::vector<EventRecord>> EventFile::ReadBehind(std::int64_t after) {
  auto events = table_->ReadBehind(after);
  if (!events) events = connection_.Failed();
  if (!connection_.is_open()) table_.reset();
  return events;
}

Status EventFile::WriteAlarms(const std::vector<Alarm>& alarms) {
  Status status;
  if (table_->WriteAlarms(alarms)) {
    lacks_alarms_ = false;
  } else {
    status = connection_.Failed();
  }
  if (!connection_.is_open()) table_.reset();
  return status;
}

}  // namespace baudgate::events
