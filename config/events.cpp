// SPDX-License-Identifier: Apache-2.0
#include "config/events.h"

#include <algorithm>
#include <optional>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "config/files.h"
#include "config/history.h"
#include "gateway/base/decimal.h"
#include "gateway/base/text.h"

namespace baudgate::config {

namespace {

struct EventAlarm {
  std::optional<std::uint32_t> channel{};  ///< empty: the row that applies to all channels
  std::uint32_t code = 0;
  AlarmPriority priority = AlarmPriority::none;
};

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

/// Returns the events that can be alarms: "E1", "2E17".
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
                 DidYouMean(key, views) + " possible events: " + Join(views)};
  }
  if (found->state != EventState::off || event.priority == AlarmPriority::none) return {};
  return Error{
      Quoted(key) +
      " only ends a state, so it raises no alarm; name an event that begins one: " + Join(views)};
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
          " is not an event; write channel and code, \"2E17\", or \"E17\" for every channel");
    return std::nullopt;
  }
  const auto priority = ReadWord(entry.value, "event_alarms", kWords<AlarmPriority>, problems);
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
    Assign(alarms.priority, ReadWord(*node, "alarms", kWords<AlarmPriority>, map.problems()));
    return alarms;
  }
  MapReader keys(*node, "alarms", map.problems());
  keys.ReadAll(alarms);
  keys.Finish();
  return alarms;
}

void ReadEventAlarms(MapReader& map, Device& device) {
  const auto node = map.Get("event_alarms");
  if (!node) return;
  Problems& problems = map.problems();
  if (device.event_texts.empty()) {
    problems.Error(node->mark(),
                   "event_alarms: " +
                       (device.profile.empty() ? "the device has no profile with a"
                                               : Quoted(device.profile) + " has no") +
                       " table of events; use a profile with events, or remove the key");
    return;
  }
  std::vector<EventAlarm> events;
  for (const Entry& entry : ReadEntries(*node, "event_alarms", problems)) {
    if (const auto event = ReadEventAlarm(entry, device, problems)) events.push_back(*event);
  }
  // Entries for one channel are applied after those for all channels, so they take precedence.
  std::stable_partition(events.begin(), events.end(),
                        [](const EventAlarm& one) { return !one.channel; });
  for (const EventAlarm& event : events) ApplyAlarm(event, device.event_texts);
  if (device.events) return;
  problems.Warning(node->mark(),
                   "event_alarms: the events of '" + device.name +
                       "' are not read; write 'events: {}' at the top level, or 'events: on' here");
}

namespace {

constexpr std::size_t kMostEvents = 16;
/// An event record has room for a text of this length, the point and its value.
constexpr std::size_t kLongestEventText = 100;

bool IsFloat(Type type) { return type == Type::float32 || type == Type::float64; }
bool IsNumber(Type type) { return type != Type::string && type != Type::boolean; }

/// Returns the range of a whole number or bit after scale and offset.
std::pair<Decimal, Decimal> EndsOf(const Point& point) {
  const IntegerRange range = RangeOf(point);
  const Decimal a = range.lowest * point.scale + point.offset;
  const Decimal b = range.highest * point.scale + point.offset;
  return {std::min(a, b), std::max(a, b)};
}

void CheckLimit(const PointEvent& event, const Point& point, const MapReader& map) {
  const bool above = event.on == PointEvent::On::above;
  const auto error = [&](std::string_view key, const std::string& text) {
    map.problems().Error(map.MarkOf(key), std::string(key) + ": " + text);
  };
  if (point.type == Type::string) {
    return error("on", "a text cannot be above or below a limit; write on: change");
  }
  if (!map.Has("value")) {
    return error("on", "'" + std::string(Name(event.on)) + "' needs a limit: { on: " +
                           std::string(Name(event.on)) + ", value: 5 }");
  }
  if (IsFloat(point.type)) return;
  const auto [low, high] = EndsOf(point);
  if (above ? event.value >= high : event.value <= low) {
    error("value", "'" + point.name + "' has the range " + low.ToText() + " to " + high.ToText() +
                       ", so it is never " + ConditionOf(event) + "; correct the limit");
    return;
  }
  const Decimal back = event.value + (above ? -event.hysteresis : event.hysteresis);
  if (above ? back < low : back > high) {
    error("hysteresis", "'" + point.name + "' has the range " + low.ToText() + " to " +
                            high.ToText() + ", so it never returns " +
                            (above ? "below " : "above ") + back.ToText() +
                            "; write a smaller number");
  }
}

void CheckHysteresis(const PointEvent& event, const Point& point, const MapReader& map) {
  if (!map.Has("hysteresis")) return;
  const auto error = [&](const std::string& text) {
    map.problems().Error(map.MarkOf("hysteresis"), "hysteresis: " + text);
  };
  if (event.hysteresis < 0) return error("must not be negative; write 0 or more");
  if (!IsNumber(point.type)) {
    return error("only numbers can have a hysteresis, but '" + point.name + "' is " +
                 std::string(Name(point.type)) + "; remove the key");
  }
  if (event.on != PointEvent::On::change || IsFloat(point.type)) return;
  const auto [low, high] = EndsOf(point);
  if (event.hysteresis >= high - low) {
    error("'" + point.name + "' has the range " + low.ToText() + " to " + high.ToText() +
          ", so it never changes by more than this; write a smaller number");
  }
}

void CheckNormal(const PointEvent& event, const Point& point, const MapReader& map) {
  if (event.normal.empty()) return;
  const auto error = [&](const std::string& text) {
    map.problems().Error(map.MarkOf("normal"), "normal: " + text);
  };
  if (event.on != PointEvent::On::change)
    return error(
        "only an event with on: change can have this key; write on: change, or remove the key");
  if (point.type == Type::boolean)
    return error("a bool point needs no normal value; remove the key");
  if (point.type == Type::string) return;
  if (const std::string why = WhyLeadingZero(event.normal); !why.empty()) {
    return error(Quoted(event.normal) + " " + why);
  }
  if (!Decimal::Parse(event.normal)) {
    error("'" + point.name + "' is a number, but " + Quoted(event.normal) +
          " is not; write a number");
  }
}

std::string ReadEventText(MapReader& map) {
  std::string text = map.Label("text").value_or("");
  if (text.size() > kLongestEventText) {
    map.problems().Error(map.MarkOf("text"), "text: the text is too long; at most " +
                                                 std::to_string(kLongestEventText) + " bytes");
  }
  return text;
}

std::string ReadRecordName(MapReader& map) {
  const auto node = map.Get("record");
  if (!node) return {};
  return ReadText(*node, "record", map.problems()).value_or("");
}

std::optional<PointEvent> ReadOne(const YamlNode& node, const Point& point, Problems& problems) {
  MapReader map(node, "event of '" + point.name + "'", problems);
  if (node.kind() != YamlNode::Kind::map) return std::nullopt;
  PointEvent event;
  const auto on = map.Need("on", "above");
  map.Read<&PointEvent::on, &PointEvent::value, &PointEvent::hysteresis, &PointEvent::delay>(event);
  event.text = ReadEventText(map);
  map.Read<&PointEvent::alarm>(event);
  event.normal = map.Label("normal").value_or("");
  event.record = ReadRecordName(map);
  map.Finish();
  if (!on) return std::nullopt;
  CheckNormal(event, point, map);
  if (event.on != PointEvent::On::change) {
    CheckLimit(event, point, map);
  } else if (map.Has("value")) {
    problems.Error(map.MarkOf("value"),
                   "value: on: change has no limit; write on: above or on: below, or remove value");
  }
  CheckHysteresis(event, point, map);
  return event;
}

}  // namespace

std::vector<PointEvent> ReadPointEvents(MapReader& map, const Point& point) {
  std::vector<PointEvent> events;
  const auto node = map.Get("events");
  if (!node) return events;
  Problems& problems = map.problems();
  if (point.access == Access::write) {
    problems.Error(node->mark(),
                   "events: '" + point.name +
                       "' can only be written, so it can have no events; remove the key");
  }
  const auto nodes = node->kind() == YamlNode::Kind::list
                         ? ReadList(*node, "events", kMostEvents, problems)
                         : std::vector<YamlNode>{*node};
  for (const YamlNode& one : nodes) {
    auto event = ReadOne(one, point, problems);
    if (!event) continue;
    const std::string condition = ConditionOf(*event);
    const auto same = [&](const auto& other) { return ConditionOf(other) == condition; };
    if (std::ranges::any_of(events, same)) {
      problems.Error(one.mark(), "events: '" + condition + "' occurs twice");
    }
    events.push_back(std::move(*event));
  }
  return events;
}

namespace {

constexpr std::size_t kMostTexts = 2000;

bool IsSame(const EventText& a, const EventText& b) {
  return a.channel == b.channel && a.code == b.code;
}

/// Checks `alarm` and `until` of a row. An alarm without `until` has no end: it only waits for its
/// acknowledgement.
void CheckAlarm(const EventText& one, const MapReader& map) {
  const auto error = [&](std::string_view key, const std::string& text) {
    map.problems().Error(map.MarkOf(key), std::string(key) + ": " + text);
  };
  if (one.until && one.state != EventState::on) return error("until", "needs state: on");
  if (one.alarm == AlarmPriority::none) {
    if (one.until)
      error("until", "only an event with an alarm can have this key; write alarm: yes");
    return;
  }
  if (one.state == EventState::off) {
    error("alarm",
          "an event with state: off raises no alarm; write alarm at the event that begins the "
          "state, with until: " +
              std::to_string(one.code));
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
      problems.Error(marks[i], "until: the table has no code " + code +
                                   " with state: off; correct the code, or add this row");
    }
    const auto other = [&](const EventText& before) {
      return before.until == one.until && ShareChannel(one, before);
    };
    if (std::any_of(table.begin(), table.begin() + static_cast<std::ptrdiff_t>(i), other)) {
      problems.Error(
          marks[i], "until: " + code + " already ends another alarm; give each alarm its own code");
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
    map.problems().Warning(
        point->mark,
        "events of '" + point->name + "' are not stored; write 'events: {}' at the top level");
  }
  if (!device.events || has_table || has_points) return;
  map.problems().Warning(map.MarkOf("events"),
                         "events: " +
                             (device.profile.empty() ? "the device has no profile with a"
                                                     : Quoted(device.profile) + " has no") +
                             " table of events, so the gateway has no texts for events that the "
                             "device sends; use a profile with events, or remove the key");
}

std::vector<EventText> ReadEventTable(const YamlNode& node,
                                      const std::vector<RecordPattern>& records,
                                      Problems& problems) {
  std::vector<EventText> table;
  std::vector<Mark> ends;
  for (const YamlNode& element : ReadList(node, "events", kMostTexts, problems)) {
    MapReader map(element, "event", problems);
    EventText one;
    map.Read<&EventText::channel>(one);
    if (map.Need("code", "1")) map.Read<&EventText::code>(one);
    if (map.Need("text", "stage I> started")) one.text = ReadEventText(map);
    map.Read<&EventText::state, &EventText::alarm, &EventText::until>(one);
    one.record = ReadRecordName(map);
    CheckRecordName(one.record, map.MarkOf("record"), records, problems);
    CheckAlarm(one, map);
    map.Finish();
    const auto same = [&](const EventText& other) { return IsSame(one, other); };
    if (std::ranges::any_of(table, same)) {
      problems.Error(map.MarkOf("code"), "code: " + std::to_string(one.code) +
                                             " occurs twice in the table; remove one of the rows");
    }
    ends.push_back(map.MarkOf("until"));
    table.push_back(std::move(one));
  }
  CheckEnds(table, ends, problems);
  return table;
}

}  // namespace baudgate::config
