// SPDX-License-Identifier: Apache-2.0
#include "config/point_events.h"

#include <algorithm>
#include <optional>
#include <utility>

#include "gateway/base/leading_zero.h"
#include "gateway/base/spelling.h"
#include "gateway/base/text.h"

namespace baudgate::config {
namespace {

constexpr std::size_t kMostEvents = 16;
constexpr std::array<Word<PointEvent::On>, 3> kOn = {{{"change", PointEvent::On::change},
                                                      {"above", PointEvent::On::above},
                                                      {"below", PointEvent::On::below}}};
constexpr std::array<Word<AlarmPriority>, 5> kAlarms = {{{"no", AlarmPriority::none},
                                                         {"yes", AlarmPriority::medium},
                                                         {"low", AlarmPriority::low},
                                                         {"medium", AlarmPriority::medium},
                                                         {"high", AlarmPriority::high}}};

bool IsFloat(Type type) { return type == Type::float32 || type == Type::float64; }
bool IsNumber(Type type) { return type != Type::string && type != Type::boolean; }

/// The range of whole numbers and bits, in units of the value.
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
    return error("on", "a text is neither above nor below; write on: change");
  }
  if (!map.Has("value")) {
    return error("on", "'" + std::string(Name(event.on)) + "' needs a limit: { on: " +
                           std::string(Name(event.on)) + ", value: 5 }");
  }
  if (IsFloat(point.type)) return;
  const auto [low, high] = EndsOf(point);
  if (above ? event.value >= high : event.value <= low) {
    error("value", "'" + point.name + "' is from " + low.ToText() + " to " + high.ToText() +
                       ", and never " + ConditionOf(event));
    return;
  }
  const Decimal back = event.value + (above ? -event.hysteresis : event.hysteresis);
  if (above ? back < low : back > high) {
    error("hysteresis", "'" + point.name + "' is from " + low.ToText() + " to " + high.ToText() +
                            ", and never back " + (above ? "below " : "above ") + back.ToText());
  }
}

void CheckHysteresis(const PointEvent& event, const Point& point, const MapReader& map) {
  if (!map.Has("hysteresis")) return;
  const auto error = [&](const std::string& text) {
    map.problems().Error(map.MarkOf("hysteresis"), "hysteresis: " + text);
  };
  if (event.hysteresis < 0) return error("must not be negative");
  if (!IsNumber(point.type)) {
    return error("only numbers have one, and '" + point.name + "' is " +
                 std::string(Name(point.type)));
  }
  if (event.on != PointEvent::On::change || IsFloat(point.type)) return;
  const auto [low, high] = EndsOf(point);
  if (event.hysteresis >= high - low) {
    error("'" + point.name + "' is from " + low.ToText() + " to " + high.ToText() +
          ", and never changes by more");
  }
}

void CheckNormal(const PointEvent& event, const Point& point, const MapReader& map) {
  if (event.normal.empty()) return;
  const auto error = [&](const std::string& text) {
    map.problems().Error(map.MarkOf("normal"), "normal: " + text);
  };
  if (event.on != PointEvent::On::change) return error("only on: change has one");
  if (point.type == Type::boolean) return error("a bool is on and off by itself");
  if (point.type == Type::string) return;
  if (const std::string why = WhyLeadingZero(event.normal); !why.empty()) {
    return error(Quoted(event.normal) + " " + why);
  }
  if (!Decimal::Parse(event.normal)) {
    error("'" + point.name + "' is a number, and " + Quoted(event.normal) + " is none");
  }
}

std::optional<PointEvent> ReadOne(const YamlNode& node, const Point& point, Problems& problems) {
  MapReader map(node, "event of '" + point.name + "'", problems);
  if (node.kind() != YamlNode::Kind::map) return std::nullopt;
  PointEvent event;
  const auto on = map.Need("on", "above");
  if (on) Assign(event.on, ReadWord(*on, "on", kOn, problems));
  Assign(event.value, map.Number("value"));
  Assign(event.hysteresis, map.Number("hysteresis"));
  Assign(event.delay, map.Time("delay", 0ms, 24h));
  event.text = ReadEventText(map);
  event.alarm = ReadAlarm(map);
  event.normal = map.Label("normal").value_or("");
  event.record = ReadRecordName(map);
  map.Finish();
  if (!on) return std::nullopt;
  CheckNormal(event, point, map);
  if (event.on != PointEvent::On::change) {
    CheckLimit(event, point, map);
  } else if (map.Has("value")) {
    problems.Error(map.MarkOf("value"),
                   "value: every change counts; a limit needs on: above or on: below");
  }
  CheckHysteresis(event, point, map);
  return event;
}

}  // namespace

AlarmPriority ReadAlarm(MapReader& map) {
  return map.OneOf("alarm", kAlarms).value_or(AlarmPriority::none);
}

std::string ReadEventText(MapReader& map) {
  std::string text = map.Label("text").value_or("");
  if (text.size() > kLongestEventText) {
    map.problems().Error(map.MarkOf("text"), "text: it is too long; at most " +
                                                 std::to_string(kLongestEventText) + " bytes");
  }
  return text;
}

std::string ReadRecordName(MapReader& map) {
  const auto node = map.Get("record");
  if (!node) return {};
  return ReadText(*node, "record", map.problems()).value_or("");
}

std::vector<PointEvent> ReadPointEvents(MapReader& map, const Point& point) {
  std::vector<PointEvent> events;
  const auto node = map.Get("events");
  if (!node) return events;
  Problems& problems = map.problems();
  if (point.access == Access::write) {
    problems.Error(node->mark(),
                   "events: '" + point.name + "' can only be written, so nobody knows its value");
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
      problems.Error(one.mark(), "events: '" + condition + "' stands twice");
    }
    events.push_back(std::move(*event));
  }
  return events;
}

}  // namespace baudgate::config
