// SPDX-License-Identifier: Apache-2.0
#include "config/alarms.h"

#include <algorithm>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "gateway/base/leading_zero.h"
#include "gateway/base/spelling.h"
#include "gateway/base/text.h"

namespace baudgate::config {
namespace {

constexpr std::array<Word<AlarmPriority>, 4> kAlarmWords = {{{"high", AlarmPriority::high},
                                                             {"medium", AlarmPriority::medium},
                                                             {"low", AlarmPriority::low},
                                                             {"off", AlarmPriority::none}}};

/// One entry of event_alarms.
struct EventAlarm {
  std::optional<std::uint32_t> channel{};  ///< empty: of every channel
  std::uint32_t code = 0;
  AlarmPriority priority = AlarmPriority::none;
};

/// "2E17", "E3".
std::optional<EventAlarm> ParseEventAlarm(std::string_view text) {
  const std::size_t mark = text.find('E');
  if (mark == std::string_view::npos) return std::nullopt;
  EventAlarm event;
  if (mark > 0) {
    event.channel = ParseInteger<std::uint32_t>(text.substr(0, mark));
    if (!event.channel) return std::nullopt;
  }
  const auto code = ParseInteger<std::uint32_t>(text.substr(mark + 1));
  if (!code) return std::nullopt;
  event.code = *code;
  return event;
}

/// Those that can be an alarm: "E1", "2E17".
std::vector<std::string> AlarmEventsIn(const std::vector<EventText>& table) {
  std::vector<std::string> names;
  for (const EventText& one : table) {
    if (one.state == EventState::off) continue;
    names.push_back((one.channel ? std::to_string(*one.channel) : "") + "E" +
                    std::to_string(one.code));
  }
  return names;
}

Status CheckEventAlarm(const Device& device, const std::string& key, const EventAlarm& event) {
  const auto same_code = [&](const EventText& one) {
    const bool of_channel = !event.channel || !one.channel || *one.channel == *event.channel;
    return one.code == event.code && of_channel;
  };
  const auto& table = device.event_texts;
  const auto found = std::ranges::find_if(table, same_code);
  const std::vector<std::string> names = AlarmEventsIn(table);
  const std::vector<std::string_view> views(names.begin(), names.end());
  if (found == table.end()) {
    return Error{Quoted(device.profile) + " has no event " + Quoted(key) + ";" +
                 DidYouMean(key, views) + " there are: " + Join(views)};
  }
  if (found->state != EventState::off || event.priority == AlarmPriority::none) return {};
  return Error{Quoted(key) + " is the end of something and raises no alarm; name the event that " +
               "begins it: " + Join(views)};
}

void SetAlarm(EventText& row, AlarmPriority priority) {
  row.alarm = priority;
  if (priority == AlarmPriority::none) row.until.reset();
}

void ApplyAlarm(const EventAlarm& event, std::vector<EventText>& table) {
  if (!event.channel) {
    for (EventText& row : table) {
      if (row.code == event.code) SetAlarm(row, event.priority);
    }
    return;
  }
  EventText row = *FindEvent(table, *event.channel, event.code);
  const bool own = row.channel.has_value();
  row.channel = event.channel;
  SetAlarm(row, event.priority);
  if (!own) return table.push_back(std::move(row));
  for (EventText& one : table) {
    if (one.channel == row.channel && one.code == row.code) one = row;
  }
}

std::optional<EventAlarm> ReadEventAlarm(const Entry& entry, const Device& device,
                                         Problems& problems) {
  const auto error = [&](const std::string& text) {
    problems.Error(entry.value.mark(), "event_alarms: " + text);
  };
  if (const Status status = RefuseLeadingZeros(entry.key, "^E"); !status) {
    error(status.error());
    return std::nullopt;
  }
  auto event = ParseEventAlarm(entry.key);
  if (!event) {
    error(Quoted(entry.key) +
          " names no event; write channel and code, \"2E17\", or \"E17\" for every channel");
    return std::nullopt;
  }
  const auto priority = ReadWord(entry.value, "event_alarms", kAlarmWords, problems);
  if (!priority) return std::nullopt;
  event->priority = *priority;
  if (const Status known = CheckEventAlarm(device, entry.key, *event); !known) {
    error(known.error());
    return std::nullopt;
  }
  return event;
}

}  // namespace

AlarmSetting ReadAlarmSetting(MapReader& map, const AlarmSetting& above) {
  AlarmSetting alarms = above;
  const auto node = map.Get("alarms");
  if (!node) return alarms;
  if (node->kind() != YamlNode::Kind::map) {
    Assign(alarms.priority, ReadWord(*node, "alarms", kAlarmWords, map.problems()));
    return alarms;
  }
  MapReader keys(*node, "alarms", map.problems());
  Assign(alarms.priority, keys.OneOf("priority", kAlarmWords));
  Assign(alarms.delay, keys.Time("delay", 0ms, 24h));
  keys.Finish();
  return alarms;
}

void ReadEventAlarms(MapReader& map, Device& device) {
  const auto node = map.Get("event_alarms");
  if (!node) return;
  Problems& problems = map.problems();
  if (device.event_texts.empty()) {
    problems.Error(node->mark(), "event_alarms: " +
                                     (device.profile.empty() ? "there is no profile with a"
                                                             : Quoted(device.profile) + " has no") +
                                     " table of events");
    return;
  }
  std::vector<EventAlarm> events;
  for (const Entry& entry : ReadEntries(*node, "event_alarms", problems)) {
    if (const auto event = ReadEventAlarm(entry, device, problems)) events.push_back(*event);
  }
  // Those of one channel come after those of all.
  std::stable_partition(events.begin(), events.end(),
                        [](const EventAlarm& one) { return !one.channel; });
  for (const EventAlarm& event : events) ApplyAlarm(event, device.event_texts);
  if (device.events) return;
  problems.Warning(node->mark(),
                   "event_alarms: the events of '" + device.name +
                       "' are not asked for: write 'events: {}' at the top level, or 'events: on' "
                       "here");
}

}  // namespace baudgate::config
