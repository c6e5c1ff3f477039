// SPDX-License-Identifier: Apache-2.0
#include "gateway/records/events/alarm_table.h"

#include "gateway/records/events/event_record.h"

namespace baudgate::events {
namespace {

/// What stands in the file may be anything: an alarm too many is better than one too few.
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

AlarmTable::AlarmTable(Database& database)
    : database_(database),
      write_(database,
             "INSERT OR REPLACE INTO alarms (line, device, name, point, state, priority, seq, "
             "raised, changed, text, acknowledged_by) VALUES (?,?,?,?,?,?,?,?,?,?,?)"),
      remove_(database, "DELETE FROM alarms WHERE line=? AND device=? AND name=?") {}

bool AlarmTable::Read(std::vector<Alarm>& alarms) {
  Statement rows(database_,
                 "SELECT line, device, name, point, state, priority, seq, raised, changed, text, "
                 "acknowledged_by FROM alarms");
  Statement::Step step = rows.Next();
  for (; step == Statement::Step::row; step = rows.Next()) {
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
  return step == Statement::Step::done;
}

bool AlarmTable::Write(const Alarm& alarm) {
  if (alarm.state == AlarmState::normal) {
    remove_.Bind(1, alarm.line);
    remove_.Bind(2, alarm.device);
    remove_.Bind(3, alarm.name);
    return remove_.Run();
  }
  write_.Bind(1, alarm.line);
  write_.Bind(2, alarm.device);
  write_.Bind(3, alarm.name);
  write_.Bind(4, alarm.point);
  write_.Bind(5, Name(alarm.state));
  write_.Bind(6, Name(alarm.priority));
  write_.Bind(7, alarm.seq);
  write_.Bind(8, alarm.raised);
  write_.Bind(9, alarm.changed);
  write_.Bind(10, alarm.text);
  write_.Bind(11, alarm.by);
  return write_.Run();
}

}  // namespace baudgate::events
