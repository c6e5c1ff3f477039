// SPDX-License-Identifier: Apache-2.0
#include "gateway/daemon/reload/difference.h"

#include <algorithm>
#include <map>
#include <string_view>
#include <tuple>
#include <type_traits>
#include <utility>

#include "config/model/fields.h"
#include "gateway/base/shown.h"
#include "gateway/base/text.h"

namespace baudgate::reload {

namespace {

/// The maximum number of settings of a line that are named; the rest is shown as "…".
constexpr std::size_t kMostNamed = 5;

const config::Line* Find(const config::Config& config, const std::string& name) {
  const auto found = std::ranges::find(config.lines, name, &config::Line::name);
  return found == config.lines.end() ? nullptr : &*found;
}

/// Clears the settings that can change while the line continues. The poller, the roster of devices
/// and EventPath use the configuration with which the line was started, so a field that one of them
/// reads must not be cleared here. `alarms` is the exception, because EventPath gets the rules of
/// alarms again at each reload.
void WithoutWhatChangesInPlace(config::Line& line) {
  line.alarms = {};
  for (config::Device& device : line.devices) {
    device.unit.reset();
    device.alarms = {};
    device.on_bad = {};
    device.max_age.reset();
    device.dead_age.reset();
    for (config::Point& point : device.points) {
      // A point without a register is still polled.
      point.modbus.reset();
      point.table = {};
      point.deadband = 0;
      point.description = {};
      point.second_table = false;
      point.precision.reset();
      point.states = {};
    }
  }
}

class Changes {
 public:
  void Add(std::string text) {
    if (std::ranges::find(texts_, text) == texts_.end()) texts_.push_back(std::move(text));
  }
  std::string Text() const {
    std::string all;
    for (std::size_t i = 0; i < std::min(kMostNamed, texts_.size()); ++i) {
      all += (i == 0 ? "" : ", ") + texts_[i];
    }
    return texts_.size() > kMostNamed ? all + ", …" : all;
  }

 private:
  std::vector<std::string> texts_;
};

void CompareDevices(const config::Device& was, const config::Device& is, Changes& changes) {
  EachDifferent(was, is, [&](std::string_view key) {
    if (key != "points") return changes.Add(std::string(key) + " of " + is.name);
    for (const config::Point& point : is.points) {
      const auto old = std::ranges::find(was.points, point.name, &config::Point::name);
      const std::string name = is.name + "." + point.name;
      if (old == was.points.end()) {
        changes.Add(name + " is new");
        continue;
      }
      EachDifferent(*old, point,
                    [&](std::string_view its) { changes.Add(std::string(its) + " of " + name); });
    }
    for (const config::Point& point : was.points) {
      const auto left = std::ranges::find(is.points, point.name, &config::Point::name);
      if (left == is.points.end()) changes.Add(is.name + "." + point.name + " is removed");
    }
  });
}

std::string WhatChanged(const config::Line& was, const config::Line& is) {
  Changes changes;
  EachDifferent(was, is, [&](std::string_view key) {
    if (key != "devices") return changes.Add(std::string(key));
    for (const config::Device& device : is.devices) {
      const auto old = std::ranges::find(was.devices, device.name, &config::Device::name);
      if (old == was.devices.end()) {
        changes.Add("device " + device.name + " is new");
      } else {
        CompareDevices(*old, device, changes);
      }
    }
    for (const config::Device& device : was.devices) {
      const auto left = std::ranges::find(is.devices, device.name, &config::Device::name);
      if (left == is.devices.end()) changes.Add("device " + device.name + " is removed");
    }
  });
  const std::string text = changes.Text();
  return text.empty() ? "the order of its devices or points" : text;
}

LineChange CompareLines(const config::Line* was, const config::Line& is) {
  if (was == nullptr) return {is.name, Action::added, {}};
  if (Same(*was, is)) return {is.name, Action::same, {}};
  config::Line bare_was = *was;
  config::Line bare_is = is;
  WithoutWhatChangesInPlace(bare_was);
  WithoutWhatChangesInPlace(bare_is);
  const bool in_place = Same(bare_was, bare_is);
  return {is.name, in_place ? Action::in_place : Action::restarted, WhatChanged(*was, is)};
}

/// Returns the history points by name; the key is "line.device.point".
std::map<std::string, config::HistoryPoint> HistoryOf(const config::Config& config) {
  std::map<std::string, config::HistoryPoint> points;
  std::uint32_t device = 0;
  for (const config::Line& line : config.lines) {
    for (const config::Device& its : line.devices) {
      for (const config::HistoryPoint& point : config.history.points) {
        if (point.device != device) continue;
        points.emplace(line.name + "." + its.name + "." + its.points[point.point].name, point);
      }
      ++device;
    }
  }
  return points;
}

bool SameHistory(const config::Config& running, const config::Config& next) {
  const auto same = [](const auto& a, const auto& b) {
    return a.first == b.first && Same(a.second, b.second);
  };
  return std::ranges::equal(HistoryOf(running), HistoryOf(next), same);
}

template <typename Section>
void CompareKey(std::string_view key, const Section& was, const Section& is,
                Difference& difference) {
  if constexpr (requires { Section::kReloads; }) {
    auto& names = Section::kReloads ? difference.settings : difference.restart;
    EachDifferent(was, is, [&](std::string_view its) {
      names.push_back(its == key ? std::string(key) : std::string(key) + "." + std::string(its));
    });
  } else if (key != "lines" && key != "modbus" && key != "history" && !config::Same(was, is)) {
    (key == "gateway.alarms" ? difference.settings : difference.restart).emplace_back(key);
  }  // other functions compare lines, modbus and history
}

void CompareHistory(const config::Config& running, const config::Config& next,
                    Difference& difference) {
  EachDifferent(running.history, next.history, [&](std::string_view key) {
    if (key == "points") return;  // points are compared by name below
    const std::string name = "history." + std::string(key);
    (key == "directory" ? difference.restart : difference.settings).push_back(name);
  });
  if (!SameHistory(running, next)) difference.settings.emplace_back("history.points");
}

template <typename Change>
std::size_t Count(const std::vector<Change>& changes, Action action) {
  return static_cast<std::size_t>(std::ranges::count(changes, action, &Change::action));
}

template <typename Change>
bool AllSame(const std::vector<Change>& changes) {
  return Count(changes, Action::same) == changes.size();
}

std::string SentenceOf(const LineChange& line) {
  const std::string begin = "line " + line.line + ": ";
  switch (line.action) {
    case Action::same:
      break;
    case Action::in_place:
      return begin + "keeps running; changed: " + line.what;
    case Action::restarted:
      return begin + "restarts: " + line.what;
    case Action::added:
      return begin + "is new";
    case Action::removed:
      return begin + "is removed";
  }
  return {};
}

/// Appends text such as "1 listener new, 2 listeners changed". `anew` is the word for changed
/// items.
template <typename Change>
void SumUp(const std::vector<Change>& changes, std::string_view name, std::string_view anew,
           std::string& text) {
  const auto say = [&](Action action, std::string_view what) {
    const std::size_t count = Count(changes, action);
    if (count == 0) return;
    text += (text.empty() ? "" : ", ") + Plural(count, name) + " " + std::string(what);
  };
  say(Action::added, "new");
  say(Action::restarted, anew);
  say(Action::removed, "removed");
  say(Action::in_place, "updated in place");
}

}  // namespace

bool Difference::empty() const {
  return settings.empty() && restart.empty() && AllSame(lines) && AllSame(modbus.listeners) &&
         AllSame(modbus.routes);
}

Difference Compare(const config::Config& running, const config::Config& next) {
  Difference difference;
  for (const config::Line& line : next.lines) {
    difference.lines.push_back(CompareLines(Find(running, line.name), line));
  }
  for (const config::Line& line : running.lines) {
    if (line.name.empty() || Find(next, line.name) != nullptr) continue;
    difference.lines.push_back({line.name, Action::removed, {}});
  }
  VisitFields(&running, [&](auto field) {
    if constexpr (field.is_setting) {
      CompareKey(field.key, running.*field.member, next.*field.member, difference);
    }
  });
  if (running.modbus.enabled != next.modbus.enabled) {
    difference.restart.emplace_back("modbus.enabled");
  }
  difference.modbus = CompareModbus(running.modbus, next.modbus);
  for (const std::string& blocked : difference.modbus.restart) {
    difference.restart.push_back(blocked);
  }
  if (difference.modbus.route_order) difference.settings.emplace_back("the order of modbus.routes");
  CompareHistory(running, next, difference);
  return difference;
}

std::vector<std::string> Sentences(const Difference& difference) {
  std::vector<std::string> sentences;
  const auto tell = [&sentences](const auto& changes) {
    for (const auto& change : changes) {
      if (change.action != Action::same) sentences.push_back(SentenceOf(change));
    }
  };
  tell(difference.lines);
  tell(difference.modbus.listeners);
  tell(difference.modbus.routes);
  for (const std::string& setting : difference.settings) sentences.push_back(setting + ": changed");
  for (const std::string& setting : difference.restart) {
    sentences.push_back(setting + ": only a restart can change it");
  }
  return sentences;
}

std::string Summary(const Difference& difference) {
  if (difference.empty()) return "nothing has changed";
  std::string text;
  SumUp(difference.lines, "line", "restarted", text);
  SumUp(difference.modbus.listeners, "listener", "changed", text);
  SumUp(difference.modbus.routes, "route", "restarted", text);
  if (!difference.settings.empty()) {
    text += (text.empty() ? "" : ", ") + Plural(difference.settings.size(), "setting");
  }
  const std::size_t same = Count(difference.lines, Action::same);
  if (text.empty()) return Plural(same, "line") + " untouched";
  return text + (same > 0 ? "; " + Plural(same, "line") + " untouched" : "");
}

std::optional<std::string> WhyNot(const Difference& difference) {
  if (difference.restart.empty()) return std::nullopt;
  std::string names;
  for (const std::string& name : difference.restart) names += (names.empty() ? "" : ", ") + name;
  return "only a restart can change " + names;
}

namespace {

config::Line Empty(const config::Line& line) {
  config::Line empty;
  empty.devices.resize(line.devices.size());
  return empty;
}

/// Maps the number of each line and device in the file to its number in the placed configuration
/// (Placement).
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

/// True if the interlocks of both lines refer to the same numbers of devices and points.
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
