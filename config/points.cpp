// SPDX-License-Identifier: Apache-2.0
#include "config/points.h"

#include <algorithm>
#include <map>
#include <utility>

#include "config/checks/name_checks.h"
#include "config/checks/point_checks.h"
#include "config/point_events.h"
#include "config/point_values.h"
#include "config/writing.h"
#include "gateway/base/spelling.h"

namespace baudgate::config {
namespace {

constexpr std::array<Word<Access>, 3> kAccess = {
    {{"r", Access::read}, {"w", Access::write}, {"rw", Access::read_write}}};
constexpr std::array<Word<Group>, kNamedGroups> kGroupWords = {
    {{"once", Group::once}, {"daily", Group::daily}, {"slow", Group::slow}, {"fast", Group::fast}}};
constexpr std::array<Word<Table>, 4> kTables = {{{"input", Table::registers},
                                                 {"holding", Table::registers},
                                                 {"discrete", Table::bits},
                                                 {"coil", Table::bits}}};
constexpr std::uint16_t kLastAddress = 65535;

// DDS carries the unit as string<16>.
constexpr std::size_t kLongestUnit = 16;

void ReadAddresses(MapReader& map, Point& point) {
  Assign(point.access, map.OneOf("access", kAccess));
  Assign(point.write, map.Text("write"));
  if (point.access == Access::write && !point.write.empty()) {
    Assign(point.read, map.Text("read"));
    return;
  }
  const auto read = map.Need("read", "\"…\" (the protocol's own address)");
  if (read) Assign(point.read, ReadText(*read, "read", map.problems()));
}

void ReadType(MapReader& map, Point& point) {
  const auto node = map.Need("type", "float32");
  if (!node) return;
  const auto text = ReadText(*node, "type", map.problems());
  if (!text) return;
  const auto type = ParseType(*text);
  if (!type) {
    map.problems().Error(node->mark(), "type: " + type.error());
    return;
  }
  point.type = type->type;
  point.text_length = type->text_length;
  point.time_type = type->time_type;
  point.unit = UnitOf(type->time_type);
}

void ReadPeriod(MapReader& map, Point& point) {
  Assign(point.group, map.OneOf("group", kGroupWords));
  point.poll = map.Time("poll", kShortestPoll, std::chrono::hours(24));
  if (!point.poll) return;
  if (map.Has("group")) {
    map.problems().Error(
        map.MarkOf("poll"),
        "poll: '" + point.name + "' has a group as well; keep its own interval, or the group's");
  }
  point.group = Group::own;
}

void ReadPlace(MapReader& map, Point& point) {
  point.modbus = map.Integer<std::uint16_t>("modbus", 0, kLastAddress);
  // The Modbus contract: booleans stand in the bit tables unless they are told to take a register.
  point.table = point.type == Type::boolean ? Table::bits : Table::registers;
  Assign(point.table, map.OneOf("table", kTables));
}

void ReadMeaning(MapReader& map, Point& point) {
  Assign(point.unit, map.Label("unit"));
  if (point.unit.size() > kLongestUnit) {
    map.problems().Error(map.MarkOf("unit"),
                         "unit: " + Quoted(point.unit) + " is too long; at most 16 bytes");
  }
  ReadPeriod(map, point);
  Assign(point.scale, map.Number("scale"));
  Assign(point.offset, map.Number("offset"));
  Assign(point.deadband, map.Number("deadband"));
  point.jump = map.Number("jump");
  const auto recheck = ReadRecheck(map);
  Assign(point.recheck, recheck);
  // What counts as a jump matters only where jumps are read twice.
  if (point.jump && !recheck && point.recheck == Recheck::off) point.recheck = Recheck::jump;
  Assign(point.description, map.Label("description"));
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
      // The rest of it is judged anyway, so that all errors are told at once.
      point.name = "#" + std::to_string(++nameless);
      points.push_back(std::move(point));
      continue;
    }
    const auto [earlier, is_new] = first.emplace(Lower(*name), node->mark());
    if (!is_new) {
      problems.Error(node->mark(), "point '" + *name + "' stands twice; first in line " +
                                       std::to_string(earlier->second.line));
      continue;
    }
    point.name = *name;
    points.push_back(std::move(point));
  }
  return points;
}

namespace {

/// Neither `read` nor `type`: this means to change a point of the profile.
bool OnlyChanges(const RawPoint& point) {
  return std::none_of(point.keys.begin(), point.keys.end(), [](const Entry& entry) {
    return entry.key == "read" || entry.key == "write" || entry.key == "type";
  });
}

/// Each says how often the point is read.
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
                                     target.name + "' of the profile; write it the same way");
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

std::vector<Point> BuildPoints(const std::vector<RawPoint>& raw, const Protocol* protocol,
                               Problems& problems, Recheck recheck) {
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
      problems.Error(point.mark, "poll: '" + point.name + "' would be the " +
                                     std::to_string(kMostIntervals + 1) +
                                     "th interval of its device; at most " +
                                     std::to_string(kMostIntervals) +
                                     " different ones, beside those of its groups");
      continue;
    }
    if (known == device.intervals.end()) device.intervals.push_back(*point.poll);
    point.group = OwnGroup(place);
  }
}

}  // namespace baudgate::config
