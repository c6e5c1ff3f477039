// SPDX-License-Identifier: Apache-2.0
#include "gateway/daemon/reload/slots.h"

#include <algorithm>
#include <map>
#include <tuple>
#include <utility>

namespace baudgate::reload {
namespace {

config::Line Empty(const config::Line& line) {
  config::Line empty;
  empty.devices.resize(line.devices.size());
  return empty;
}

/// Old number → new number, of lines and of devices of one file.
struct Numbers {
  std::map<std::size_t, std::size_t> lines;
  std::map<std::uint32_t, std::uint32_t> devices;
};

Numbers NumbersOf(const std::vector<config::Line>& file, const config::Config& placed) {
  Numbers numbers;
  std::uint32_t first = 0;
  for (std::size_t line = 0; line < file.size(); ++line) {
    const auto at = std::ranges::find(placed.lines, file[line].name, &config::Line::name);
    const auto slot = static_cast<std::size_t>(at - placed.lines.begin());
    numbers.lines[line] = slot;
    const std::uint32_t placed_first = config::FirstDevice(placed, slot);
    for (std::uint32_t i = 0; i < file[line].devices.size(); ++i) {
      numbers.devices[first + i] = placed_first + i;
    }
    first += static_cast<std::uint32_t>(file[line].devices.size());
  }
  return numbers;
}

void Renumber(config::Config& config, const Numbers& numbers) {
  for (config::Line& line : config.lines) {
    for (config::Device& device : line.devices) {
      for (config::Point& point : device.points) {
        for (config::AllowWhen& one : point.writing.allow_when) {
          one.device = numbers.devices.at(one.device);
        }
      }
    }
  }
  for (config::HistoryPoint& point : config.history.points) {
    point.device = numbers.devices.at(point.device);
  }
  std::ranges::sort(config.history.points, {}, [](const config::HistoryPoint& point) {
    return std::tie(point.device, point.point);
  });
  for (config::Route& route : config.modbus.routes) {
    if (!route.line.empty()) route.line_index = numbers.lines.at(route.line_index);
  }
}

/// What interlocks of this line look at has the same numbers.
bool SameNumbers(const config::Line& a, const config::Line& b) {
  for (std::size_t device = 0; device < a.devices.size(); ++device) {
    for (std::size_t point = 0; point < a.devices[device].points.size(); ++point) {
      const auto& of_a = a.devices[device].points[point].writing.allow_when;
      const auto& of_b = b.devices[device].points[point].writing.allow_when;
      for (std::size_t i = 0; i < of_a.size(); ++i) {
        if (of_a[i].device != of_b[i].device || of_a[i].index != of_b[i].index) return false;
      }
    }
  }
  return true;
}

bool GoesOn(const LineChange& change) {
  return change.action == Action::same || change.action == Action::in_place;
}

}  // namespace

Placement PlaceInSlots(const config::Config& running, config::Config next,
                       const Difference& difference) {
  Placement placed;
  std::vector<config::Line> file = std::exchange(next.lines, {});
  placed.config = std::move(next);
  std::map<std::string, const LineChange*> changes;
  for (const LineChange& change : difference.lines) changes[change.line] = &change;
  for (std::uint32_t i = 0; i < running.lines.size(); ++i) {
    const config::Line& line = running.lines[i];
    const auto found = std::ranges::find(file, line.name, &config::Line::name);
    if (!line.name.empty() && found != file.end() && GoesOn(*changes.at(line.name))) {
      placed.config.lines.push_back(*found);
    } else {
      if (!line.name.empty()) placed.gone.push_back(i);
      placed.config.lines.push_back(Empty(line));
    }
  }
  for (const config::Line& line : file) {
    if (GoesOn(*changes.at(line.name))) continue;
    placed.begun.push_back(static_cast<std::uint32_t>(placed.config.lines.size()));
    placed.config.lines.push_back(line);
  }
  Renumber(placed.config, NumbersOf(file, placed.config));
  for (std::uint32_t i = 0; i < running.lines.size(); ++i) {
    const config::Line& line = placed.config.lines[i];
    if (line.name.empty()) continue;
    const bool in_place = changes.at(line.name)->action == Action::in_place;
    if (in_place || !SameNumbers(running.lines[i], line)) placed.updated.push_back(i);
  }
  return placed;
}

}  // namespace baudgate::reload
