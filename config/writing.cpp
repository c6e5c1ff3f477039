// SPDX-License-Identifier: Apache-2.0
#include "config/writing.h"

#include <algorithm>
#include <span>
#include <string>
#include <string_view>

#include "config/checks/uniques.h"
#include "gateway/base/decimal.h"
#include "gateway/base/text.h"

namespace baudgate::config {
namespace {

constexpr std::size_t kMostInterlocks = 16;
constexpr std::size_t kMostListed = 1000;

bool CanBeWritten(const Point& point) { return point.access != Access::read; }

std::optional<AllowWhen> ReadInterlock(const YamlNode& node, Problems& problems) {
  MapReader map(node, "allow_when", problems);
  if (node.kind() != YamlNode::Kind::map) return std::nullopt;
  AllowWhen interlock;
  interlock.mark = node.mark();
  const auto point = map.Need("point", "LINE.DEVICE.POINT");
  const auto is = map.Need("is", "true");
  if (const auto only = map.Text("for")) interlock.only = *only;
  map.Finish();
  if (!point || !is) return std::nullopt;
  const auto name = ReadText(*point, "point", problems);
  const auto value = ReadText(*is, "is", problems);
  if (!name || !value) return std::nullopt;
  interlock.point = *name;
  interlock.is = *value;
  return interlock;
}

std::string WhatCan(std::string_view name, std::span<const std::string_view> names) {
  constexpr std::size_t kMostNamed = 12;
  if (names.empty()) return " no point of this device can be written";
  const std::string text = DidYouMean(name, names) + " points that can be written: ";
  if (names.size() <= kMostNamed) return text + Join(names);
  return text + Join(names.first(kMostNamed)) + " and " +
         std::to_string(names.size() - kMostNamed) + " more";
}

/// True for the words `allow` and `deny`. They are written without brackets, but `write: [allow]`
/// is a frequent mistake.
bool IsPermit(std::string_view word) { return word == "allow" || word == "deny"; }

void AllowListed(const YamlNode& list, Device& device, Problems& problems) {
  std::vector<std::string_view> names;
  for (const Point& point : device.points) {
    if (CanBeWritten(point)) names.push_back(point.name);
  }
  for (const YamlNode& one : ReadList(list, "write", kMostListed, problems)) {
    const auto name = ReadText(one, "write", problems);
    if (!name) continue;
    const auto found = std::ranges::find(device.points, *name, &Point::name);
    if (found != device.points.end() && CanBeWritten(*found)) {
      found->writing.allowed = true;
      continue;
    }
    const std::string wrong =
        "write: " + Quoted(*name) +
        (found == device.points.end() ? " is not a point of '" : " can only be read in '") +
        device.name + "';";
    problems.Error(one.mark(),
                   wrong + (IsPermit(*name) ? " for all of the device's points, write 'write: " +
                                                  *name + "' without brackets"
                                            : WhatCan(*name, names)));
  }
}

/// Reads `max: 50`, or `max: pr1_maximum_frequency`.
void ReadLimit(MapReader& map, std::string_view key, std::optional<Decimal>& number,
               Shared<std::string>& point) {
  const auto node = map.Get(key);
  if (!node) return;
  const bool is_name = node->kind() == YamlNode::Kind::scalar && CheckPointName(node->text());
  if (is_name) {
    point = node->text();
  } else {
    number = map.Number(key);
  }
}

/// The parts of a name such as "bay-1.feeder-1.local".
struct PointName {
  std::string_view line;
  std::string_view device;
  std::string_view point;
};
std::optional<PointName> SplitName(std::string_view text) {
  const auto first = text.find('.');
  if (first == std::string_view::npos) return std::nullopt;
  const auto second = text.find('.', first + 1);
  if (second == std::string_view::npos) return std::nullopt;
  return PointName{text.substr(0, first), text.substr(first + 1, second - first - 1),
                   text.substr(second + 1)};
}

template <typename Named>
std::optional<std::size_t> IndexOf(const std::vector<Named>& all, std::string_view name) {
  const auto found = std::ranges::find(all, name, &Named::name);
  if (found == all.end()) return std::nullopt;
  return static_cast<std::size_t>(found - all.begin());
}

/// Returns the element with this name, or else with the most similar name; null if none is similar.
template <typename Named>
const Named* NearestOf(const std::vector<Named>& all, std::string_view name) {
  if (const auto exact = IndexOf(all, name)) return &all[*exact];
  std::vector<std::string_view> names;
  for (const Named& one : all) names.emplace_back(one.name);
  const auto near = IndexOf(all, Nearest(name, names));
  return near ? &all[*near] : nullptr;
}

std::string MeantPlace(const Config& config, std::string_view text) {
  const auto name = SplitName(text);
  const Line* const line = name ? NearestOf(config.lines, name->line) : nullptr;
  const Device* const device = line != nullptr ? NearestOf(line->devices, name->device) : nullptr;
  const Point* const point = device != nullptr ? NearestOf(device->points, name->point) : nullptr;
  if (point == nullptr) return {};
  return " did you mean '" + line->name + "." + device->name + "." + point->name + "'?";
}

std::optional<Value> ValueOf(const Point& point, const std::string& text) {
  if (point.type == Type::string) return text;
  if (point.type == Type::boolean) {
    if (text == "true" || text == "on" || text == "1") return true;
    if (text == "false" || text == "off" || text == "0") return false;
    return std::nullopt;
  }
  const auto number = Decimal::Parse(text);
  if (!number) return std::nullopt;
  const bool is_float = point.type == Type::float32 || point.type == Type::float64;
  const bool scaled = point.scale != 1 || point.offset != 0;
  if (is_float) return number->ToDouble();
  if (!scaled && !RangeOf(point).Contains(*number)) return std::nullopt;
  if (!scaled && !number->is_whole()) return std::nullopt;
  return number->ToValue();
}

class Resolver {
 public:
  Resolver(const Config& config, Problems& problems) : config_(config), problems_(problems) {}

  /// Finds the point that `interlock` names. `guarded` is the point that has the interlock.
  void Resolve(AllowWhen& interlock, const Point& guarded) {
    const auto name = SplitName(interlock.point);
    const auto line = name ? IndexOf(config_.lines, name->line) : std::nullopt;
    const auto device = line ? IndexOf(config_.lines[*line].devices, name->device) : std::nullopt;
    const auto* points = device ? &config_.lines[*line].devices[*device].points : nullptr;
    const auto point = points ? IndexOf(*points, name->point) : std::nullopt;
    // If the device's points are unknown because of an error, that error is already reported.
    if (points != nullptr && points->empty() && problems_.has_error()) return;
    if (!point) {
      return Complain(interlock, "is not a point of the configuration;" +
                                     MeantPlace(config_, interlock.point) +
                                     " write LINE.DEVICE.POINT");
    }
    const Point& found = (*points)[*point];
    if (found.access == Access::write) {
      return Complain(interlock,
                      "cannot be read, so it cannot be a condition; name a point that can be read");
    }
    const std::string& is = std::get<std::string>(interlock.is);
    const std::string zero = found.type == Type::string ? std::string() : WhyLeadingZero(is);
    if (!zero.empty()) return Complain(interlock, "is: " + Quoted(is) + " " + zero);
    const auto value = ValueOf(found, is);
    if (!value) {
      return Complain(interlock, "is " + std::string(Name(found.type)) + ", so it is never " +
                                     Quoted(std::get<std::string>(interlock.is)) +
                                     "; correct 'is'");
    }
    if (&found == &guarded) {
      return Complain(interlock,
                      "is also the point that this interlock guards, so after a write of another "
                      "value every write would be refused; name another point");
    }
    if (const auto* only = std::get_if<std::string>(&interlock.only)) {
      const std::string why = guarded.type == Type::string ? std::string() : WhyLeadingZero(*only);
      if (!why.empty()) return Complain(interlock, "for: " + Quoted(*only) + " " + why);
      const auto guards = ValueOf(guarded, *only);
      if (!guards) {
        return Complain(interlock, "for: '" + guarded.name + "' is " +
                                       std::string(Name(guarded.type)) + ", so it is never " +
                                       Quoted(*only) + "; correct 'for'");
      }
      interlock.only = *guards;
    }
    interlock.is = *value;
    interlock.device = FirstDevice(config_, *line) + static_cast<std::uint32_t>(*device);
    interlock.index = static_cast<std::uint32_t>(*point);
  }

 private:
  /// Reports a problem once, although the interlocks of a device are copied to each of its points.
  void Complain(const AllowWhen& interlock, const std::string& why) {
    const std::string place = interlock.mark.ToString();
    if (place == last_) return;
    last_ = place;
    problems_.Error(interlock.mark, "allow_when: " + Quoted(interlock.point) + " " + why);
  }

  const Config& config_;
  Problems& problems_;
  std::string last_;
};

std::vector<AllowWhen> ReadAllowWhen(MapReader& map) {
  const auto node = map.Get("allow_when");
  if (!node) return {};
  std::vector<YamlNode> nodes = {*node};
  if (node->kind() == YamlNode::Kind::list) {
    nodes = ReadList(*node, "allow_when", kMostInterlocks, map.problems());
  }
  std::vector<AllowWhen> interlocks;
  for (const YamlNode& one : nodes) {
    if (auto interlock = ReadInterlock(one, map.problems())) {
      interlocks.push_back(std::move(*interlock));
    }
  }
  return interlocks;
}

}  // namespace

Writing ReadWriting(MapReader& map) {
  Writing writing;
  ReadLimit(map, "min", writing.min, writing.min_point);
  ReadLimit(map, "max", writing.max, writing.max_point);
  map.Read<&Writing::step, &Writing::decimals, &Writing::select, &Writing::select_time>(writing);
  writing.allow_when = ReadAllowWhen(map);
  return writing;
}

void ApplyWritePermit(MapReader& map, Device& device) {
  const std::vector<AllowWhen> interlocks = ReadAllowWhen(map);
  for (Point& point : device.points) {
    const std::string itself = "." + device.name + "." + point.name;
    for (const AllowWhen& interlock : interlocks) {
      if (!CanBeWritten(point) || interlock.point.ends_with(itself)) continue;
      point.writing.allow_when.push_back(interlock);
    }
  }
  const auto node = map.Get("write");
  const bool none = std::ranges::none_of(device.points, CanBeWritten);
  if (none && !interlocks.empty()) {
    map.problems().Error(map.MarkOf("allow_when"),
                         "allow_when: no point of '" + device.name +
                             "' can be written; give points access: rw, or remove 'allow_when'");
  }
  if (!node) return;
  if (node->kind() == YamlNode::Kind::list) return AllowListed(*node, device, map.problems());
  if (!ReadWord(*node, "write", kDenyAllow, map.problems()).value_or(false)) return;
  if (none) {
    return map.problems().Error(node->mark(), "write: no point of '" + device.name +
                                                  "' can be written; give points access: rw, or "
                                                  "remove 'write'");
  }
  for (Point& point : device.points) point.writing.allowed = CanBeWritten(point);
}

void ResolveInterlocks(Config& config, Problems& problems) {
  Resolver resolver(config, problems);
  for (Line& line : config.lines) {
    for (Device& device : line.devices) {
      for (Point& point : device.points) {
        std::ranges::for_each(point.writing.allow_when,
                              [&](AllowWhen& interlock) { resolver.Resolve(interlock, point); });
      }
    }
  }
}

}  // namespace baudgate::config
