// SPDX-License-Identifier: Apache-2.0
#include "config/validate.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <limits>

#include "config/network.h"
#include "config/spelling.h"
#include "gateway/base/text.h"

namespace baudgate::config {
namespace {

bool IsFloat(Type type) { return type == Type::float32 || type == Type::float64; }

/// Whether a register of this type can hold the number.
bool Fits(Type type, double number) {
  if (type == Type::float32) return std::abs(number) <= std::numeric_limits<float>::max();
  if (type == Type::float64) return true;
  return number == std::trunc(number) && RangeOf(type).Contains(number);
}

void CheckOnFault(const Point& point, const Mark& mark, Problems& problems) {
  const std::string type(Name(point.type));
  if (point.on_fault.kind == OnFault::Kind::nan && !IsFloat(point.type)) {
    problems.Error(mark, "on_fault: nan needs a float type, and '" + point.name + "' is " + type +
                             "; write hold or a number");
  }
  if (point.on_fault.kind != OnFault::Kind::value) return;
  const double value = point.on_fault.value;
  if (point.type == Type::string || !Fits(point.type, value)) {
    problems.Error(mark, "on_fault: " + FormatNumber(value) + " does not fit type " + type);
  }
}

void CheckArithmetic(const Point& point, const MapReader& map, Problems& problems) {
  const bool is_number = point.type != Type::string && point.type != Type::boolean;
  if (point.scale == 0) {
    problems.Error(map.MarkOf("scale"), "scale: 0 would make every value the same");
  }
  if (!is_number && point.scale != 1) {
    problems.Error(map.MarkOf("scale"), "scale: only numbers can be scaled, and '" + point.name +
                                            "' is " + std::string(Name(point.type)));
  }
  if (!is_number && point.offset != 0) {
    problems.Error(map.MarkOf("offset"), "offset: only numbers have one, and '" + point.name +
                                             "' is " + std::string(Name(point.type)));
  }
  if (point.deadband < 0) {
    problems.Error(map.MarkOf("deadband"), "deadband: must not be negative");
  }
  if (point.type == Type::string && !point.sentinels.empty()) {
    problems.Error(map.MarkOf("sentinels"), "sentinels: a string has none");
  }
}

std::string Range(int first, int last) {
  if (first == last) return std::to_string(first);
  return std::to_string(first) + "…" + std::to_string(last);
}

bool InAllowedRange(int first, int last) {
  return last <= 8999 || (first >= 9100 && last <= 19999);
}

}  // namespace

void CheckPoint(const Point& point, const MapReader& map) {
  Problems& problems = map.problems();
  if (point.table == Table::bits && point.type != Type::boolean) {
    problems.Error(map.MarkOf("table"), "table: only bool points fit a bit table, and '" +
                                            point.name + "' is " + std::string(Name(point.type)) +
                                            "; write table: input");
  }
  if (!point.write.empty() && point.access == Access::read) {
    problems.Error(map.MarkOf("write"),
                   "write: '" + point.name + "' is read-only; add access: rw or remove 'write'");
  }
  if (point.simulate && point.simulate->text && point.simulate->text->size() > point.text_length &&
      point.text_length > 0) {
    problems.Error(map.MarkOf("simulate"), "simulate: the text is longer than string(" +
                                               std::to_string(point.text_length) + ")");
  }
  CheckArithmetic(point, map, problems);
  CheckOnFault(point, map.MarkOf("on_fault"), problems);
}

void RegisterMap::Add(const Point& point, const Mark& mark) {
  if (!point.modbus) return;
  const int first = *point.modbus;
  const int count = point.table == Table::bits ? 1 : static_cast<int>(RegisterCount(point));
  const int last = first + count - 1;
  const std::string kind = point.table == Table::bits ? "bit " : "register ";
  if (!InAllowedRange(first, last)) {
    problems_.Error(mark, "modbus: " + kind + Range(first, last) + " of '" + point.name +
                              "' is reserved; points live at 0…8999 and 9100…19999");
    return;
  }
  auto& table = TableOf(point);
  auto next = table.upper_bound(first);
  const Taken* other = nullptr;
  int other_first = 0;
  if (next != table.begin() && std::prev(next)->second.last >= first) --next;
  if (next != table.end() && next->first <= last) {
    other = &next->second;
    other_first = next->first;
  }
  if (!other) {
    table.emplace(first, Taken{last, point.name, mark});
    return;
  }
  problems_.Error(mark, "modbus: " + kind + Range(first, last) + " of '" + point.name +
                            "' overlaps " + Range(other_first, other->last) + " of '" +
                            other->name + "' (" + other->mark.ToString() + ")");
}

const Uniques::Owner* Uniques::Claim(Owners& owners, const std::string& what,
                                     const std::string& name, const Mark& mark) {
  const auto [owner, is_new] = owners.emplace(what, Owner{name, mark});
  return is_new ? nullptr : &owner->second;
}

void Uniques::Line(const std::string& name, const Mark& mark) {
  if (const Owner* first = Claim(lines_, name, name, mark)) {
    problems_.Error(mark, "line name '" + name + "' is taken; first in line " +
                              std::to_string(first->mark.line) + " of the file");
  }
}

void Uniques::Device(const std::string& name, const Mark& mark) {
  if (const Owner* first = Claim(devices_, name, name, mark)) {
    problems_.Error(mark, "device name '" + name + "' is taken; first in line " +
                              std::to_string(first->mark.line) + " of the file");
  }
}

void Uniques::Unit(std::uint8_t unit, const std::string& device, const Mark& mark) {
  if (const Owner* first = Claim(units_, std::to_string(unit), device, mark)) {
    problems_.Error(mark, "unit: " + std::to_string(unit) + " is taken by device '" + first->name +
                              "' (line " + std::to_string(first->mark.line) + ")");
  }
}

void Uniques::Port(const std::string& port, const std::string& line, const Mark& mark) {
  std::string real = port;
  if (!port.starts_with("tcp://")) {
    std::error_code error;
    const auto canonical = std::filesystem::weakly_canonical(port, error);
    if (!error) real = canonical.string();
  }
  if (const Owner* first = Claim(ports_, real, line, mark)) {
    problems_.Error(mark, "port: " + Quoted(port) + " is already the port of line '" + first->name +
                              "'; put the devices on one line");
  }
}

void Uniques::Listener(const std::string& at, const Mark& mark) {
  if (const Owner* first = Claim(listeners_, at, at, mark)) {
    problems_.Error(
        mark, "listen: " + at + " stands twice; first in line " + std::to_string(first->mark.line));
  }
}

void CheckDevice(const Device& device, const MapReader& map) {
  Problems& problems = map.problems();
  if (!map.Has("profile") && !map.Has("points")) {
    problems.Warning(device.mark, map.what() +
                                      " has no points: nothing will be read from it; "
                                      "give it a profile or points");
  }
  const Duration max_age = device.max_age.value_or(3 * device.poll);
  if (max_age < device.poll) {
    problems.Error(map.MarkOf("max_age"),
                   "max_age: " + FormatDuration(max_age) + " is shorter than poll (" +
                       FormatDuration(device.poll) + "): every value would be stale");
  }
  if (device.dead_age && *device.dead_age < max_age) {
    problems.Error(map.MarkOf("dead_age"), "dead_age: " + FormatDuration(*device.dead_age) +
                                               " is shorter than max_age (" +
                                               FormatDuration(max_age) + ")");
  }
  const bool has_slow = std::any_of(device.points.begin(), device.points.end(),
                                    [](const Point& p) { return p.group == Group::slow; });
  if (device.max_age && has_slow && *device.max_age < device.slow && max_age >= device.poll) {
    problems.Warning(map.MarkOf("max_age"),
                     "max_age: " + FormatDuration(max_age) + " is shorter than slow (" +
                         FormatDuration(device.slow) + "): slow points will often be uncertain");
  }
}

void CheckTiming(const Timing& timing, const Mark& mark, Problems& problems) {
  if (timing.ceiling && timing.reply && *timing.ceiling < *timing.reply) {
    problems.Error(mark, "timing: ceiling " + FormatDuration(*timing.ceiling) +
                             " is shorter than reply " + FormatDuration(*timing.reply) +
                             "; it covers the whole exchange");
  }
}

void CheckListener(const Listener& listener, Problems& problems) {
  const bool everywhere = listener.host == "0.0.0.0" || listener.host == "::";
  if (!everywhere || listener.allow.empty()) return;
  if (std::all_of(listener.allow.begin(), listener.allow.end(), IsLoopback)) {
    problems.Warning(listener.mark, "listen: " + listener.host +
                                        " takes connections from everywhere, but 'allow' has only "
                                        "loopback; write 127.0.0.1 or allow the masters' network");
  }
}

}  // namespace baudgate::config
