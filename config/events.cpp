// SPDX-License-Identifier: Apache-2.0
#include "config/events.h"

#include <algorithm>

#include "config/outputs.h"
#include "config/point_events.h"
#include "config/records.h"
#include "gateway/base/spelling.h"

namespace baudgate::config {
namespace {

constexpr std::size_t kMostTexts = 2000;
constexpr std::uint32_t kLastChannel = 999;
constexpr std::uint32_t kLastCode = 999'999;
constexpr std::array<Word<EventState>, kEventStates> kStates = {
    {{"off", EventState::off}, {"on", EventState::on}, {"message", EventState::message}}};

bool IsSame(const EventText& a, const EventText& b) {
  return a.channel == b.channel && a.code == b.code;
}

/// Without an end it only waits to be acknowledged.
void CheckAlarm(const EventText& one, const MapReader& map) {
  const auto error = [&](std::string_view key, const std::string& text) {
    map.problems().Error(map.MarkOf(key), std::string(key) + ": " + text);
  };
  if (one.until && one.state != EventState::on) return error("until", "needs state: on");
  if (one.alarm == AlarmPriority::none) {
    if (one.until) error("until", "only an alarm has an end; write alarm: yes");
    return;
  }
  if (one.state == EventState::off) {
    error("alarm",
          "it stands at the event that begins it, with until: " + std::to_string(one.code));
  }
}

bool ShareChannel(const EventText& a, const EventText& b) {
  return !a.channel || !b.channel || a.channel == b.channel;
}

void CheckEnds(const std::vector<EventText>& table, const std::vector<Mark>& marks,
               Problems& problems) {
  for (std::size_t i = 0; i < table.size(); ++i) {
    const EventText& one = table[i];
    if (!one.until) continue;
    const std::string code = std::to_string(*one.until);
    const auto ends = [&](const EventText& other) {
      return other.code == *one.until && other.state == EventState::off && ShareChannel(one, other);
    };
    if (std::ranges::none_of(table, ends)) {
      problems.Error(marks[i], "until: the table has no code " + code + " with state: off");
    }
    const auto other = [&](const EventText& before) {
      return before.until == one.until && ShareChannel(one, before);
    };
    if (std::any_of(table.begin(), table.begin() + static_cast<std::ptrdiff_t>(i), other)) {
      problems.Error(marks[i], "until: " + code + " ends another alarm already");
    }
  }
}

}  // namespace

Events ReadEvents(const YamlNode& node, Problems& problems) {
  Events events;
  MapReader map(node, "events", problems);
  events.given = true;
  events.directory = ReadAbsolutePath(map, "directory", "/data/baudgate");
  map.Finish();
  return events;
}

void ReadDeviceEvents(MapReader& map, bool given, Device& device) {
  const bool has_table = !device.event_texts.empty();
  const auto point =
      std::ranges::find_if(device.points, [](const Point& one) { return !one.events.empty(); });
  const bool has_points = point != device.points.end();
  const auto wanted = map.Flag("events");
  device.events = wanted.value_or(given && has_table);
  device.point_events = has_points && wanted.value_or(given);
  if (has_points && !wanted && !given && *point->mark.file == *device.mark.file) {
    map.problems().Warning(point->mark, "events of '" + point->name +
                                            "' are not kept: write 'events: {}' at the top level");
  }
  if (!device.events || has_table || has_points) return;
  map.problems().Warning(map.MarkOf("events"),
                         "events: " +
                             (device.profile.empty() ? "there is no profile with a"
                                                     : Quoted(device.profile) + " has no") +
                             " table of events: its events have no texts, and there are none if "
                             "the protocol has none");
}

std::vector<EventText> ReadEventTable(const YamlNode& node,
                                      const std::vector<RecordPattern>& records,
                                      Problems& problems) {
  std::vector<EventText> table;
  std::vector<Mark> ends;
  for (const YamlNode& element : ReadList(node, "events", kMostTexts, problems)) {
    MapReader map(element, "event", problems);
    EventText one;
    one.channel = map.Integer<std::uint32_t>("channel", 0, kLastChannel);
    if (map.Need("code", "1")) {
      Assign(one.code, map.Integer<std::uint32_t>("code", 1, kLastCode));
    }
    if (map.Need("text", "stage I> started")) one.text = ReadEventText(map);
    Assign(one.state, map.OneOf("state", kStates));
    one.alarm = ReadAlarm(map);
    one.until = map.Integer<std::uint32_t>("until", 1, kLastCode);
    one.record = ReadRecordName(map);
    CheckRecordName(one.record, map.MarkOf("record"), records, problems);
    CheckAlarm(one, map);
    map.Finish();
    const auto same = [&](const EventText& other) { return IsSame(one, other); };
    if (std::ranges::any_of(table, same)) {
      problems.Error(map.MarkOf("code"),
                     "code: " + std::to_string(one.code) + " stands in the table twice");
    }
    ends.push_back(map.MarkOf("until"));
    table.push_back(std::move(one));
  }
  CheckEnds(table, ends, problems);
  return table;
}

}  // namespace baudgate::config
