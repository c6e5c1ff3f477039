// SPDX-License-Identifier: Apache-2.0
#include "gateway/events/own_records.h"

#include <algorithm>
#include <utility>

#include "gateway/base/shown.h"

namespace baudgate::events {
namespace {

EventRecord OwnRecord(OwnCode code, std::string text, WallTime at) {
  EventRecord record;
  record.received = record.device_time = at;
  record.clock = ClockQuality::gateway;
  record.code = CodeOf(code);
  record.text = std::move(text);
  Shorten(record.text);
  return record;
}

EventRecord AlarmRecord(OwnCode code, const std::string& words, const Alarm& alarm, WallTime at) {
  EventRecord record = OwnRecord(code, words + alarm.text, at);
  record.line = alarm.line;
  record.device = alarm.device;
  record.subject = alarm.name;
  return record;
}

struct Words {
  OwnCode code;
  const char* begins;
  const char* over;  ///< null: it has no end
};

constexpr Words kWords[] = {
    {OwnCode::port_down, "port down", "port open again"},
    {OwnCode::port_lent, "port lent to another program", "port taken back"},
    {OwnCode::collisions, "collisions", "no collisions for a minute"},
    {OwnCode::ring_open, "the ring is open", "the ring is closed again"},
    {OwnCode::no_answer, "does not answer", "answers again"},
    {OwnCode::not_in_use, "taken out of use", "in use again"},
    {OwnCode::wrong_device, "not what it should be", "what it should be again"},
    {OwnCode::replaced, "another device", nullptr},
    {OwnCode::port_served, "a client has the port", "the client has left"},
    {OwnCode::clock_corrected, "clock corrected", nullptr},
    {OwnCode::clock_left, "clock not corrected", nullptr},
};

}  // namespace

EventRecord StartRecord(const std::string& version, const LastRun& before, WallTime at) {
  std::string text = "baudgate " + version + " has started";
  if (before.end == LastRun::End::in_order) {
    text += "; the run before ended in order";
  } else if (before.end == LastRun::End::broken_off) {
    text += "; the run before was broken off after " + FormatWallTime(before.last);
  }
  return OwnRecord(OwnCode::started, std::move(text), at);
}

EventRecord EndRecord(WallTime at) { return OwnRecord(OwnCode::stops, "the gateway ends", at); }

EventRecord DiskTroubleRecord(const std::string& file, std::string_view trouble, WallTime since,
                              WallTime at) {
  if (trouble.starts_with(file + ": ")) trouble.remove_prefix(file.size() + 2);
  return OwnRecord(
      OwnCode::disk_trouble,
      "no event could be kept since " + FormatWallTime(since) + ": " + std::string(trouble), at);
}

EventRecord LeftOutRecord(std::uint64_t events, const EventRecord& last, WallTime since,
                          WallTime at) {
  EventRecord record = OwnRecord(OwnCode::left_out,
                                 Plural(events, "event") + " like the next one left out since " +
                                     FormatWallTime(since) + ": too many",
                                 at);
  record.line = last.line;
  record.device = last.device;
  return record;
}

EventRecord NotWatchedRecord(const Alarm& alarm, WallTime at) {
  EventRecord record =
      AlarmRecord(OwnCode::not_watched, "not in the configuration any more: ", alarm, at);
  record.state = config::EventState::off;
  record.mark = {.step = AlarmMark::Step::clear};
  return record;
}

EventRecord PriorityRecord(const Alarm& alarm, config::AlarmPriority priority, WallTime at) {
  const std::string change = std::string("priority ") + std::string(Name(priority)) + ", was " +
                             std::string(Name(alarm.priority)) + ": ";
  EventRecord record = AlarmRecord(OwnCode::priority, change.c_str(), alarm, at);
  record.mark = {.step = AlarmMark::Step::priority, .priority = priority};
  return record;
}

EventRecord OwnAlarmRecord(Trouble trouble, const std::string& line, const std::string& device,
                           AlarmMark mark, std::string text, WallTime at) {
  EventRecord record = OwnRecord(OwnCode::own_alarm, std::move(text), at);
  record.line = line;
  record.device = device;
  record.subject = Name(trouble);
  record.state = mark.step == AlarmMark::Step::raise   ? config::EventState::on
                 : mark.step == AlarmMark::Step::clear ? config::EventState::off
                                                       : config::EventState::message;
  record.mark = std::move(mark);
  return record;
}

EventRecord AckRecord(const Alarm& alarm, const AckQuery& query, WallTime at) {
  EventRecord record =
      AlarmRecord(OwnCode::acknowledged, "acknowledged by " + query.by + ": ", alarm, at);
  const bool of_one = query.seq != 0 || query.number;
  record.mark = {
      .step = AlarmMark::Step::acknowledge, .by = query.by, .seq = of_one ? alarm.seq : 0};
  return record;
}

EventRecord FactRecord(const Fact& fact, WallTime at) {
  const Words& words = *std::ranges::find(kWords, fact.code, &Words::code);
  std::string text = fact.over && words.over != nullptr ? words.over : words.begins;
  if (!fact.why.empty() && fact.why != text) text += ": " + fact.why;
  EventRecord record = OwnRecord(fact.code, std::move(text), at);
  record.line = fact.line;
  record.device = fact.device;
  record.state = words.over == nullptr ? config::EventState::message
                 : fact.over           ? config::EventState::off
                                       : config::EventState::on;
  return record;
}

}  // namespace baudgate::events
