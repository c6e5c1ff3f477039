// SPDX-License-Identifier: Apache-2.0
#include "config/points.h"

#include <algorithm>
#include <charconv>
#include <map>
#include <utility>

#include "config/checks/point_checks.h"
#include "config/checks/uniques.h"
#include "config/events.h"
#include "config/writing.h"
#include "gateway/base/decimal.h"
#include "gateway/base/shown.h"
#include "gateway/base/text.h"

namespace baudgate::config {

namespace {

// DDS carries text as string<128>.
constexpr std::size_t kLongestText = 128;

constexpr std::array<Word<Quality>, 8> kQualities = {
    {{"sensor_failure", Quality::bad_sensor_failure},
     {"device_failure", Quality::bad_device_failure},
     {"configuration", Quality::bad_configuration},
     {"not_connected", Quality::bad_not_connected},
     {"out_of_service", Quality::bad_out_of_service},
     {"last_usable", Quality::uncertain_last_usable},
     {"sub_normal", Quality::uncertain_sub_normal},
     {"uncertain", Quality::uncertain}}};

constexpr std::array<Quality::Code, 8> kByCode = {
    Quality::bad_configuration,     Quality::bad_not_connected,   Quality::bad_device_failure,
    Quality::bad_sensor_failure,    Quality::bad_out_of_service,  Quality::uncertain,
    Quality::uncertain_last_usable, Quality::uncertain_sub_normal};

// Parses a quality code in hex. Returns nothing for a quality that a sentinel cannot have: a good
// one, and those that only the gateway sets (waiting, communication).
std::optional<Quality> QualityOfCode(std::string_view text) {
  if (!text.starts_with("0x") && !text.starts_with("0X")) return std::nullopt;
  const auto code = ParseInteger<std::uint8_t>(text.substr(2), 16);
  if (!code) return std::nullopt;
  const auto found = std::find(kByCode.begin(), kByCode.end(), static_cast<Quality::Code>(*code));
  if (found == kByCode.end()) return std::nullopt;
  return *found;
}

std::optional<Quality> ReadQuality(const YamlNode& node, const std::string& what,
                                   Problems& problems) {
  if (node.kind() == YamlNode::Kind::scalar) {
    if (const auto quality = QualityOfCode(node.text())) return quality;
  }
  return ReadWord(node, what, kQualities, problems);
}

std::optional<double> ReadLevel(const YamlNode& node, Problems& problems) {
  if (node.kind() == YamlNode::Kind::scalar && node.text() == "true") return 1;
  if (node.kind() == YamlNode::Kind::scalar && node.text() == "false") return 0;
  const auto level = ReadNumber(node, "simulate", problems);
  return level ? std::optional(level->ToDouble()) : std::nullopt;
}

constexpr std::pair<std::string_view, TypeText> kIecTypes[] = {
    {"BOOL", {Type::boolean}},
    {"SINT", {Type::int8}},
    {"USINT", {Type::uint8}},
    {"BYTE", {Type::uint8}},
    {"INT", {Type::int16}},
    {"UINT", {Type::uint16}},
    {"WORD", {Type::uint16}},
    {"DINT", {Type::int32}},
    {"UDINT", {Type::uint32}},
    {"DWORD", {Type::uint32}},
    {"LINT", {Type::int64}},
    {"ULINT", {Type::uint64}},
    {"LWORD", {Type::uint64}},
    {"REAL", {Type::float32}},
    {"LREAL", {Type::float64}},
    {"TIME", {Type::uint32, 0, TimeType::time}},
    {"DATE", {Type::uint32, 0, TimeType::date}},
    {"TOD", {Type::uint32, 0, TimeType::time_of_day}},
    {"TIME_OF_DAY", {Type::uint32, 0, TimeType::time_of_day}},
    {"DT", {Type::uint32, 0, TimeType::date_time}},
    {"DATE_AND_TIME", {Type::uint32, 0, TimeType::date_time}},
};

}  // namespace

std::string_view UnitOf(TimeType type) {
  if (type == TimeType::none) return "";
  return type == TimeType::time || type == TimeType::time_of_day ? "ms" : "s";
}

Result<TypeText> ParseType(std::string_view text) {
  std::vector<std::string_view> shown;
  for (const auto& [name, type] : kWords<Type>) {
    if (type != Type::string && text == name) return TypeText{type, 0};
    shown.push_back(type != Type::string ? name : "string(n)");
  }
  for (const auto& [name, type] : kIecTypes) {
    if (text == name) return type;
  }
  if (const Status status = RefuseLeadingZeros(text, "(["); !status) return Error{status.error()};
  const bool iec = text.starts_with("STRING");
  const std::string_view length_text = text.substr(std::min<std::size_t>(6, text.size()));
  const bool round = length_text.starts_with("(") && length_text.ends_with(")");
  const bool square = iec && length_text.starts_with("[") && length_text.ends_with("]");
  if ((iec || text.starts_with("string")) && (round || square)) {
    const auto length = ParseInteger<std::size_t>(length_text.substr(1, length_text.size() - 2));
    if (length && *length >= 1 && *length <= kLongestText) {
      return TypeText{Type::string, *length};
    }
    return Error{Quoted(text) + " has no usable length; allowed: string(1)…string(128)"};
  }
  if (text == "string" || text == "STRING") {
    return Error{Quoted(text) + " needs its length in bytes: string(16)"};
  }
  for (const auto& [name, type] : kIecTypes) {
    if (Lower(name) != Lower(text)) continue;
    return Error{Quoted(text) + " is unknown; did you mean '" + std::string(name) + "'?"};
  }
  return Error{Quoted(text) + " is unknown;" + DidYouMean(text, shown) +
               " allowed: " + Join(shown) + ", or a type of IEC 61131-3 such as REAL"};
}

namespace {

/// Reads { 999: sensor_failure, 0x8000: out_of_service }: a quality by its name without "bad" or
/// "uncertain", or its code in hex. ResolveSentinels converts the numbers later.
std::vector<Sentinel> ReadSentinels(const YamlNode& node, Problems& problems) {
  std::vector<Sentinel> sentinels;
  for (const Entry& entry : ReadEntries(node, "sentinels", problems)) {
    const Mark mark = entry.value.source()->MarkAt(entry.place);
    if (const std::string why = WhyLeadingZero(entry.key); !why.empty()) {
      problems.Error(mark, "sentinels: " + Quoted(entry.key) + " " + why);
      continue;
    }
    const auto value = Decimal::Parse(entry.key);
    if (!value) {
      problems.Error(
          mark,
          "sentinels: " + Quoted(entry.key) +
              " is not a number; write { 999: sensor_failure } or { 0xFFFF: sensor_failure }");
      continue;
    }
    const auto quality = ReadQuality(entry.value, "sentinels: " + entry.key, problems);
    if (!quality) continue;
    sentinels.push_back({*value, *quality, entry.key, mark});
  }
  return sentinels;
}

// Longer texts would widen every table of values.
constexpr std::size_t kLongestState = 32;
constexpr std::size_t kMostStates = 64;

/// Returns why `text` cannot stand for `value`; empty: it can.
std::string WhyNoState(std::string_view text, const std::vector<StateText>& others) {
  if (text.empty()) return "needs a text";
  if (text.size() > kLongestState) {
    return "has a text of more than " + std::to_string(kLongestState) + " bytes; write a short one";
  }
  if (WithoutControls(text) != text) return "has a text with control characters; remove them";
  if (Trim(text) != text) {
    return "has the text " + Quoted(text) + ", which begins or ends with a space; remove the space";
  }
  double number = 0;
  const std::string_view digits = text.substr(text.starts_with('+') || text.starts_with('-'));
  const char* const end = digits.data() + digits.size();
  // Reads "nan" as well.
  const bool is_number = !digits.empty() && std::from_chars(digits.data(), end, number).ptr == end;
  if (is_number || Decimal::Parse(text)) {
    return "has the number " + Quoted(text) +
           " for its text, which would be taken for the value; write a word";
  }
  const auto same = std::ranges::find(others, text, &StateText::text);
  if (same == others.end()) return {};
  return "has the same text as " + std::to_string(same->value) + "; write different texts";
}

/// Reads { 0: off, 3: run }.
std::vector<StateText> ReadStates(const YamlNode& node, Problems& problems) {
  std::vector<StateText> states;
  const std::vector<Entry> entries = ReadEntries(node, "states", problems);
  if (entries.size() > kMostStates) {
    problems.Error(node.mark(),
                   "states: at most " + std::to_string(kMostStates) + " values can have a text");
    return states;
  }
  for (const Entry& entry : entries) {
    const Mark mark = entry.value.source()->MarkAt(entry.place);
    const std::string zero = WhyLeadingZero(entry.key);
    const auto number = Decimal::Parse(entry.key);
    const auto value = number && number->is_whole() ? number->ToInt64() : std::nullopt;
    if (!zero.empty() || !value) {
      problems.Error(mark,
                     "states: " + Quoted(entry.key) + " " +
                         (zero.empty() ? "is no whole number; write { 0: off, 3: run }" : zero));
      continue;
    }
    const auto text = ReadText(entry.value, "states: " + entry.key, problems);
    if (!text) continue;
    std::string why = WhyNoState(*text, states);
    if (std::ranges::find(states, *value, &StateText::value) != states.end()) why = "occurs twice";
    if (!why.empty()) problems.Error(mark, "states: " + entry.key + " " + why);
    if (why.empty()) states.push_back({*value, *text});
  }
  if (entries.empty() && node.kind() == YamlNode::Kind::map) {
    problems.Error(node.mark(), "states: is empty; write { 0: off, 3: run }");
  }
  return states;
}

std::optional<OnFault> ReadOnFault(const YamlNode& node, Problems& problems) {
  return ReadParsed(node, "on_fault", problems, [](const std::string& text) -> Result<OnFault> {
    if (text == "nan") return OnFault{OnFault::Kind::nan, {}};
    if (text == "hold") return OnFault{OnFault::Kind::hold, {}};
    const std::string zero = WhyLeadingZero(text);
    if (!zero.empty()) return Error{Quoted(text) + " " + zero};
    const auto value = Decimal::Parse(text);
    if (value) return OnFault{OnFault::Kind::value, *value};
    return Error{Quoted(text) + " is unknown; allowed: nan, hold or a number"};
  });
}

/// Reads [low, high], or one fixed value; for a string point, its text.
std::optional<Simulate> ReadSimulate(const YamlNode& node, Type type, Problems& problems) {
  if (type == Type::string) {
    const auto text = ReadText(node, "simulate", problems);
    if (!text) return std::nullopt;
    return Simulate{0, 0, *text};
  }
  if (node.kind() != YamlNode::Kind::list) {
    const auto value = ReadLevel(node, problems);
    if (!value) return std::nullopt;
    return Simulate{*value, *value, std::nullopt};
  }
  const std::vector<YamlNode> ends = ReadList(node, "simulate", 2, problems);
  if (ends.size() != 2) {
    problems.Error(node.mark(), "simulate: a range has two ends; write [low, high]");
    return std::nullopt;
  }
  const auto low = ReadLevel(ends[0], problems);
  const auto high = ReadLevel(ends[1], problems);
  if (!low || !high) return std::nullopt;
  if (*low > *high) {
    problems.Error(node.mark(), "simulate: the low end is above the high end; write [low, high]");
    return std::nullopt;
  }
  return Simulate{*low, *high, std::nullopt};
}

// DDS carries the unit as string<16>.
constexpr std::size_t kLongestUnit = 16;

void ReadAddresses(MapReader& map, Point& point) {
  map.Read<&Point::access, &Point::write>(point);
  const bool needed = point.access != Access::write || point.write.empty();
  if (needed) map.Need("read", "\"…\" (the protocol's own address)");
  map.Read<&Point::read>(point);
}

void ReadType(MapReader& map, Point& point) {
  const auto node = map.Need("type", "float32");
  if (!node) return;
  const auto type = ReadParsed(*node, "type", map.problems(), ParseType);
  if (!type) return;
  point.type = type->type;
  point.text_length = type->text_length;
  point.time_type = type->time_type;
  point.unit = UnitOf(type->time_type);
}

void ReadPeriod(MapReader& map, Point& point) {
  map.Read<&Point::group, &Point::poll>(point);
  if (!point.poll) return;
  if (map.Has("group")) {
    map.problems().Error(map.MarkOf("poll"),
                         "poll: '" + point.name + "' has a group as well; remove poll or group");
  }
  point.group = Group::own;
}

void ReadPlace(MapReader& map, Point& point) {
  map.Read<&Point::modbus>(point);
  // The Modbus contract: booleans are in the bit tables unless the configuration puts them in a
  // register.
  point.table = point.type == Type::boolean ? Table::bits : Table::registers;
  map.Read<&Point::table>(point);
  const auto node = map.Get("table");
  point.second_table = node && (node->text() == "holding" || node->text() == "coil");
}

void ReadMeaning(MapReader& map, Point& point) {
  Assign(point.unit, map.Label("unit"));
  if (point.unit.size() > kLongestUnit) {
    map.problems().Error(map.MarkOf("unit"),
                         "unit: " + Quoted(point.unit) + " is too long; at most 16 bytes");
  }
  ReadPeriod(map, point);
  map.Read<&Point::scale, &Point::offset, &Point::deadband, &Point::jump>(point);
  const bool recheck = map.Read<&Point::recheck>(point);
  // `jump` has an effect only with recheck, so it switches recheck on.
  if (point.jump && !recheck && point.recheck == Recheck::off) point.recheck = Recheck::jump;
  Assign(point.description, map.Label("description"));
  map.Read<&Point::precision>(point);
  if (const auto node = map.Get("states")) point.states = ReadStates(*node, map.problems());
  if (const auto node = map.Get("sentinels")) {
    point.sentinels = ReadSentinels(*node, map.problems());
  }
  if (const auto node = map.Get("on_fault")) {
    Assign(point.on_fault, ReadOnFault(*node, map.problems()));
  }
  if (const auto node = map.Get("simulate")) {
    Assign(point.simulate, ReadSimulate(*node, point.type, map.problems()));
  }
}

Point ReadPoint(const RawPoint& raw, Recheck recheck, MapReader& map) {
  Point point;
  point.recheck = recheck;
  point.name = raw.name;
  point.mark = raw.mark;
  map.Get("name");
  ReadType(map, point);
  ReadAddresses(map, point);
  ReadPlace(map, point);
  ReadMeaning(map, point);
  point.writing = ReadWriting(map);
  point.events = ReadPointEvents(map, point);
  map.Finish();
  return point;
}

}  // namespace

std::vector<RawPoint> ReadRawPoints(const YamlNode& list, Problems& problems) {
  std::vector<RawPoint> points;
  std::map<std::string, Mark> first;
  int nameless = 0;
  for (const YamlNode& element : ReadList(list, "points", kMostPoints, problems)) {
    RawPoint point{"", element.mark(), ReadEntries(element, "point", problems)};
    if (element.kind() != YamlNode::Kind::map) continue;
    MapReader map(point.keys, point.mark, "point", problems);
    const auto node = map.Need("name", "current_l1");
    const auto name = node ? ReadText(*node, "name", problems) : std::nullopt;
    const Status status = name ? CheckPointName(*name) : Status();
    if (!status) problems.Error(node->mark(), "name: " + status.error());
    if (!name || !status) {
      // The nameless point stays in the list, so that all its errors are reported at once.
      point.name = "#" + std::to_string(++nameless);
      points.push_back(std::move(point));
      continue;
    }
    const auto [earlier, is_new] = first.emplace(Lower(*name), node->mark());
    if (!is_new) {
      problems.Error(node->mark(), "point '" + *name + "' occurs twice; first in line " +
                                       std::to_string(earlier->second.line));
      continue;
    }
    point.name = *name;
    points.push_back(std::move(point));
  }
  return points;
}

namespace {

/// True if the entry has no `read`, `write` and `type`, so that it changes a point of the profile.
bool OnlyChanges(const RawPoint& point) {
  return std::none_of(point.keys.begin(), point.keys.end(), [](const Entry& entry) {
    return entry.key == "read" || entry.key == "write" || entry.key == "type";
  });
}

/// True if `a` and `b` are `poll` and `group`, which exclude each other: each sets how often the
/// point is read.
bool Rivals(const std::string& a, const std::string& b) {
  return (a == "poll" && b == "group") || (a == "group" && b == "poll");
}

void ExplainUnknownPoint(const RawPoint& point, const std::vector<RawPoint>& base,
                         Problems& problems) {
  std::vector<std::string_view> names;
  for (const RawPoint& one : base) names.push_back(one.name);
  problems.Error(point.mark, "point " + Quoted(point.name) + " is not in the profile;" +
                                 DidYouMean(point.name, names) +
                                 " a new point needs 'type' and 'read'");
}

}  // namespace

std::vector<RawPoint> MergePoints(std::vector<RawPoint> base, const std::vector<RawPoint>& over,
                                  Problems& problems) {
  std::map<std::string, std::size_t> index;
  for (std::size_t i = 0; i < base.size(); ++i) index.emplace(Lower(base[i].name), i);
  for (const RawPoint& point : over) {
    const auto found = index.find(Lower(point.name));
    if (found == index.end()) {
      if (!index.empty() && OnlyChanges(point) && !point.name.starts_with('#')) {
        ExplainUnknownPoint(point, base, problems);
        continue;
      }
      base.push_back(point);
      continue;
    }
    RawPoint& target = base[found->second];
    if (target.name != point.name) {
      problems.Error(point.mark, "point '" + point.name + "' differs only in case from '" +
                                     target.name +
                                     "' of the profile; write the name as in the profile");
      continue;
    }
    target.mark = point.mark;
    for (const Entry& key : point.keys) {
      std::erase_if(target.keys, [&](const Entry& old) {
        return old.key == key.key || Rivals(old.key, key.key);
      });
      target.keys.push_back(key);
    }
  }
  return base;
}

std::vector<Point> BuildPoints(const std::vector<RawPoint>& raw,
                               const protocols::Protocol* protocol, Problems& problems,
                               Recheck recheck) {
  std::vector<Point> points;
  RegisterClaims registers(problems);
  points.reserve(raw.size());
  for (const RawPoint& one : raw) {
    MapReader map(one.keys, one.mark, "point '" + one.name + "'", problems);
    points.push_back(ReadPoint(one, recheck, map));
    CheckPoint(points.back(), protocol, map.keys(), problems);
    registers.Add(points.back(), map.MarkOf("modbus"));
  }
  CheckLimitPoints(points, problems);
  return points;
}

void AssignIntervals(Device& device, Problems& problems) {
  device.intervals.clear();
  bool told = false;
  for (Point& point : device.points) {
    if (!point.poll) continue;
    const auto known = std::ranges::find(device.intervals, *point.poll);
    const auto place = static_cast<std::size_t>(known - device.intervals.begin());
    if (place == kMostIntervals) {
      if (std::exchange(told, true)) continue;
      problems.Error(point.mark,
                     "poll: '" + point.name + "' would be the " +
                         std::to_string(kMostIntervals + 1) +
                         "th different poll period of its device, but at most " +
                         std::to_string(kMostIntervals) +
                         " are possible; use an existing value, or a group (fast, slow, daily)");
      continue;
    }
    if (known == device.intervals.end()) device.intervals.push_back(*point.poll);
    point.group = OwnGroup(place);
  }
}

}  // namespace baudgate::config
