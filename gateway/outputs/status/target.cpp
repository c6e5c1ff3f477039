// SPDX-License-Identifier: Apache-2.0
#include "gateway/outputs/status/target.h"

#include <algorithm>
#include <string>
#include <vector>

#include "gateway/base/text.h"

namespace baudgate::status {
namespace {

template <typename Named>
std::vector<std::string_view> NamesOf(const std::vector<Named>& all) {
  std::vector<std::string_view> names;
  for (const Named& one : all) {
    if (!one.name.empty()) names.push_back(one.name);  // empty: removed by a reload
  }
  return names;
}

Error NoSuchLine(const config::Config& config, std::string_view name) {
  for (const config::Line& line : config.lines) {
    for (const config::Device& device : line.devices) {
      if (device.name != name) continue;
      return {Quoted(name) + " is a device of line '" + line.name + "': write " + line.name + "." +
              device.name};
    }
  }
  const auto names = NamesOf(config.lines);
  if (name.empty()) return {"name a line; lines: " + Join(names)};
  return {"there is no line " + Quoted(name) + ";" + DidYouMean(name, names) +
          " lines: " + Join(names)};
}

}  // namespace

Result<Target> FindDevice(const config::Config& config, std::uint32_t line, std::string_view name) {
  const auto& devices = config.lines[line].devices;
  for (std::size_t slot = 0; slot < devices.size(); ++slot) {
    if (name.empty() || devices[slot].name != name) continue;
    return Target{line, config::FirstDevice(config, line) + static_cast<std::uint32_t>(slot)};
  }
  const auto names = NamesOf(devices);
  return Error{"line '" + config.lines[line].name + "' has no device " + Quoted(name) + ";" +
               DidYouMean(name, names) + " its devices: " + Join(names)};
}

Result<Target> FindTarget(const config::Config& config, std::string_view text) {
  const auto dot = text.find('.');
  const std::string_view name = text.substr(0, dot);
  for (std::uint32_t line = 0; line < config.lines.size(); ++line) {
    if (name.empty() || config.lines[line].name != name) continue;
    if (dot == std::string_view::npos) return Target{line};
    return FindDevice(config, line, text.substr(dot + 1));
  }
  return NoSuchLine(config, name);
}

Result<PointTarget> FindPoint(const config::Config& config, std::string_view text) {
  const auto dot = text.find('.', std::min(text.find('.'), text.size() - 1) + 1);
  const auto target = FindTarget(config, text.substr(0, dot));
  if (!target) return Error{target.error()};
  if (!target->device) return Error{"name a point: " + std::string(text) + ".DEVICE.POINT"};
  const std::size_t slot = *target->device - config::FirstDevice(config, target->line);
  const config::Device& device = config.lines[target->line].devices[slot];
  const auto names = NamesOf(device.points);
  if (dot == std::string_view::npos) {
    return Error{"name a point: " + std::string(text) + ".POINT; its points: " + Join(names)};
  }
  const std::string_view name = text.substr(dot + 1);
  for (std::uint32_t i = 0; i < device.points.size(); ++i) {
    if (device.points[i].name == name) return PointTarget{*target->device, i};
  }
  return Error{"'" + device.name + "' has no point " + Quoted(name) + ";" +
               DidYouMean(name, names) + " its points: " + Join(names)};
}

const config::Point* PointNamed(const config::Config& config, std::string_view text) {
  const auto parts = Split(text, '.');
  if (parts.size() != 3) return nullptr;
  const auto line = std::ranges::find(config.lines, parts[0], &config::Line::name);
  if (line == config.lines.end()) return nullptr;
  const auto device = std::ranges::find(line->devices, parts[1], &config::Device::name);
  if (device == line->devices.end()) return nullptr;
  const auto point = std::ranges::find(device->points, parts[2], &config::Point::name);
  return point == device->points.end() ? nullptr : &*point;
}

Result<PointsTarget> FindPoints(const config::Config& config, std::string_view text) {
  const bool whole = std::ranges::count(text, '.') == 1;
  if (!whole) {
    const auto point = FindPoint(config, text);
    if (!point) return Error{point.error()};
    return PointsTarget{point->device, {point->point}};
  }
  const auto target = FindTarget(config, text);
  if (!target) return Error{target.error()};
  const std::size_t slot = *target->device - config::FirstDevice(config, target->line);
  const config::Device& device = config.lines[target->line].devices[slot];
  PointsTarget found{*target->device, {}};
  for (std::uint32_t i = 0; i < device.points.size(); ++i) {
    if (device.points[i].access != config::Access::write) found.points.push_back(i);
  }
  return found;
}

std::vector<std::string> PointsLike(const config::Config& config, std::string_view pattern) {
  std::vector<std::string> points;
  const auto parts = Split(pattern, '.');
  if (parts.size() != 3) return points;
  for (const config::Line& line : config.lines) {
    if (!MatchesPattern(parts[0], line.name)) continue;
    for (const config::Device& device : line.devices) {
      if (!MatchesPattern(parts[1], device.name)) continue;
      for (const config::Point& point : device.points) {
        if (!MatchesPattern(parts[2], point.name)) continue;
        points.push_back(line.name + "." + device.name + "." + point.name);
      }
    }
  }
  return points;
}

Status KnowsDevice(const config::Config& config, const std::string& line,
                   const std::string& device) {
  std::vector<std::string_view> names;
  for (const config::Line& one : config.lines) {
    for (const config::Device& its : one.devices) {
      if (its.name == device && (line.empty() || one.name == line)) return {};
      if (!its.name.empty()) names.push_back(its.name);
    }
  }
  return Error{"there is no device " + Quoted(device) +
               (line.empty() ? "" : " on line " + Quoted(line)) + ";" + DidYouMean(device, names) +
               " devices: " + Join(names)};
}

}  // namespace baudgate::status
