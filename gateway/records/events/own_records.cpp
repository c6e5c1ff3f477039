// SPDX-License-Identifier: Apache-2.0
#include "gateway/records/events/own_records.h"

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
  const char* begins = "";
  const char* over = nullptr;  ///< null: the fact has no end
};

Words WordsOf(OwnCode code) {
  switch (code) {
    case OwnCode::port_down:
      return {"port down", "port open again"};
    case OwnCode::port_lent:
      return {"port lent to another program", "port taken back"};
    case OwnCode::collisions:
      return {"collisions", "no collisions for a minute"};
    case OwnCode::ring_open:
      return {"the ring is open", "the ring is closed again"};
    case OwnCode::no_answer:
      return {"does not answer", "answers again"};
    case OwnCode::not_in_use:
      return {"taken out of use", "in use again"};
    case OwnCode::wrong_device:
      return {"does not match the configuration", "matches the configuration again"};
    case OwnCode::replaced:
      return {"another device"};
    case OwnCode::port_served:
      return {"a network client uses the port", "the client has disconnected"};
    case OwnCode::clock_corrected:
      return {"clock corrected"};
    case OwnCode::clock_left:
      return {"clock not corrected"};
    case OwnCode::started:
    case OwnCode::stops:
    case OwnCode::left_out:
    case OwnCode::disk_trouble:
    case OwnCode::point_change:
    case OwnCode::point_above:
    case OwnCode::point_below:
    case OwnCode::acknowledged:
    case OwnCode::not_watched:
    case OwnCode::reloaded:
    case OwnCode::taken_back:
    case OwnCode::own_alarm:
    case OwnCode::priority:
      break;
  }
  return {};
}

bool HasEnd(OwnCode code) { return WordsOf(code).over != nullptr; }

}  // namespace

EventRecord StartRecord(const std::string& version, const LastRun& before, WallTime at) {
  std::string text = "baudgate " + version + " has started";
  if (before.end == LastRun::End::in_order) {
    text += "; the previous run was stopped normally";
  } else if (before.end == LastRun::End::broken_off) {
    text += "; the previous run ended unexpectedly after " + FormatWallTime(before.last);
  }
  return OwnRecord(OwnCode::started, std::move(text), at);
}

EventRecord EndRecord(WallTime at) { return OwnRecord(OwnCode::stops, "the gateway ends", at); }

EventRecord DiskTroubleRecord(const std::string& file, std::string_view trouble, WallTime since,
                              WallTime at) {
  if (trouble.starts_with(file + ": ")) trouble.remove_prefix(file.size() + 2);
  return OwnRecord(
      OwnCode::disk_trouble,
      "no event could be stored since " + FormatWallTime(since) + ": " + std::string(trouble), at);
}

EventRecord LeftOutRecord(std::uint64_t events, const EventRecord& last, WallTime since,
                          WallTime at) {
  EventRecord record =
      OwnRecord(OwnCode::left_out,
                Plural(events, "event") + " like the next one in this list were not stored since " +
                    FormatWallTime(since) + ", because too many came",
                at);
  record.line = last.line;
  record.device = last.device;
  return record;
}

EventRecord NotWatchedRecord(const Alarm& alarm, WallTime at) {
  EventRecord record =
      AlarmRecord(OwnCode::not_watched, "the configuration no longer has this alarm: ", alarm, at);
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
  const bool of_one = !query.seqs.empty() || query.number;
  record.mark = {
      .step = AlarmMark::Step::acknowledge, .by = query.by, .seq = of_one ? alarm.seq : 0};
  return record;
}

EventRecord FactRecord(const Fact& fact, WallTime at) {
  const Words words = WordsOf(fact.code);
  const bool has_end = words.over != nullptr;
  std::string text = fact.over && has_end && !fact.unknown ? words.over : words.begins;
  if (fact.unknown) {
    text += ": it is unknown whether this has ended; " + fact.why;
  } else if (!fact.why.empty() && fact.why != text) {
    text += ": " + fact.why;
  }
  EventRecord record = OwnRecord(fact.code, std::move(text), at);
  record.line = fact.line;
  record.device = fact.device;
  record.state = !has_end    ? config::EventState::message
                 : fact.over ? config::EventState::off
                             : config::EventState::on;
  return record;
}

namespace {

/// True for facts whose end a line does not report if a reload has restarted it meanwhile.
bool EndsUntold(OwnCode code) {
  return code == OwnCode::collisions || code == OwnCode::ring_open || code == OwnCode::wrong_device;
}

}  // namespace

LastingFacts::LastingFacts(const config::Config& config) { NoteUse(config); }

bool LastingFacts::IsNews(const Fact& fact, bool first) {
  if (!HasEnd(fact.code)) return true;
  const Key key{fact.code, fact.line, fact.device};
  if (fact.over) return lasting_.erase(key) > 0 || !first;
  // A wrong device can be replaced by another wrong device, which makes another event.
  return lasting_.insert(key).second || fact.code == OwnCode::wrong_device;
}

std::vector<Fact> LastingFacts::Renew(const config::Config& config,
                                      const std::set<std::string>& begun) {
  std::set<DeviceKey> places;
  for (const config::Line& line : config.lines) {
    places.emplace(line.name, "");
    for (const config::Device& device : line.devices) places.emplace(line.name, device.name);
  }
  std::erase_if(lasting_, [&](const Key& key) {
    return !places.contains({std::get<1>(key), std::get<2>(key)});
  });
  std::vector<Fact> ended;
  for (const auto& [code, line, device] : lasting_) {
    if (!begun.contains(line) || !EndsUntold(code)) continue;
    ended.push_back({.code = code,
                     .over = true,
                     .line = line,
                     .device = device,
                     .why = "a reload has restarted the line",
                     .unknown = true});
  }
  for (const auto& [line, device] : NoteUse(config)) {
    ended.push_back({.code = OwnCode::not_in_use,
                     .over = true,
                     .line = line,
                     .device = device,
                     .why = "by a reload"});
  }
  for (const Fact& fact : ended) lasting_.erase({fact.code, fact.line, fact.device});
  return ended;
}

/// If the configuration has changed `enabled` of a device, the new setting applies. Otherwise the
/// device stays as a user has set it at run time. Returns the devices that were out of use and are
/// in use now.
std::vector<LastingFacts::DeviceKey> LastingFacts::NoteUse(const config::Config& config) {
  const std::map<DeviceKey, bool> before = std::exchange(enabled_, {});
  std::vector<DeviceKey> in_use;
  for (const config::Line& line : config.lines) {
    for (const config::Device& device : line.devices) {
      const DeviceKey place{line.name, device.name};
      enabled_.emplace(place, device.enabled);
      const auto was = before.find(place);
      if (was != before.end() && was->second == device.enabled) continue;
      const Key key{OwnCode::not_in_use, line.name, device.name};
      if (!device.enabled) lasting_.insert(key);
      if (device.enabled && lasting_.contains(key)) in_use.push_back(place);
    }
  }
  return in_use;
}

}  // namespace baudgate::events
