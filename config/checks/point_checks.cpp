// SPDX-License-Identifier: Apache-2.0
#include "config/checks/point_checks.h"

#include <limits>

#include "config/checks/range_text.h"
#include "config/model/modbus_addresses.h"
#include "gateway/base/text.h"

namespace baudgate::config {
namespace {

bool IsFloat(Type type) { return type == Type::float32 || type == Type::float64; }

/// Whether a register of this type can hold the number.
bool Fits(const Point& point, const Decimal& number) {
  const Type type = point.type;
  if (type == Type::float32) return Abs(number).ToDouble() <= std::numeric_limits<float>::max();
  if (type == Type::float64) return true;
  return number.is_whole() && RangeOf(point).Contains(number);
}

void CheckOnFault(const Point& point, const Mark& mark, Problems& problems) {
  const std::string type(Name(point.type));
  if (point.on_fault.kind == OnFault::Kind::nan && !IsFloat(point.type)) {
    problems.Error(mark, "on_fault: nan needs a float type, and '" + point.name + "' is " + type +
                             "; write hold or a number");
  }
  if (point.on_fault.kind != OnFault::Kind::value) return;
  const Decimal& value = point.on_fault.value;
  if (point.type == Type::string || !Fits(point, value)) {
    problems.Error(mark, "on_fault: " + value.ToText() + " does not fit type " + type);
  }
}

void CheckArithmetic(const Point& point, const Keys& keys, Problems& problems) {
  const bool is_number = point.type != Type::string && point.type != Type::boolean;
  if (point.scale == 0) {
    problems.Error(keys.MarkOf("scale"), "scale: 0 would make every value the same");
  }
  if (!is_number && point.scale != 1) {
    problems.Error(keys.MarkOf("scale"), "scale: only numbers can be scaled, and '" + point.name +
                                             "' is " + std::string(Name(point.type)));
  }
  if (!is_number && point.offset != 0) {
    problems.Error(keys.MarkOf("offset"), "offset: only numbers have one, and '" + point.name +
                                              "' is " + std::string(Name(point.type)));
  }
  if (is_number && !IsFloat(point.type)) {
    for (const auto& [key, number] :
         {std::pair{"scale", &point.scale}, {"offset", &point.offset}}) {
      if (!keys.Has(key) || number->is_whole()) continue;
      problems.Warning(keys.MarkOf(key), std::string(key) + ": '" + point.name + "' is " +
                                             std::string(Name(point.type)) +
                                             ", so its decimals are rounded away; write type: "
                                             "float32, and what the device holds in 'read'");
    }
  }
  if (point.jump && (*point.jump < 0 || !is_number)) {
    problems.Error(keys.MarkOf("jump"), is_number ? "jump: must not be negative"
                                                  : "jump: only numbers jump, and '" + point.name +
                                                        "' is " + std::string(Name(point.type)) +
                                                        ", of which each change counts");
  }
  if (point.deadband < 0) {
    problems.Error(keys.MarkOf("deadband"), "deadband: must not be negative");
  }
  if (point.type == Type::string && !point.sentinels.empty()) {
    problems.Error(keys.MarkOf("sentinels"), "sentinels: a string has none");
  }
}

void CheckWriting(const Point& point, const Keys& keys, Problems& problems) {
  const Writing& writing = point.writing;
  const bool is_number = point.type != Type::string && point.type != Type::boolean;
  const auto error = [&](std::string_view key, const std::string& text) {
    problems.Error(keys.MarkOf(key), std::string(key) + ": " + text);
  };
  for (const std::string_view key : {"min", "max", "step", "decimals"}) {
    if (keys.Has(key) && !is_number) {
      error(key,
            "only numbers have one, and '" + point.name + "' is " + std::string(Name(point.type)));
    }
  }
  if (writing.min && writing.max && *writing.min > *writing.max) {
    error("min", writing.min->ToText() + " is above max (" + writing.max->ToText() + ")");
  }
  if (writing.step && *writing.step <= 0) error("step", "must be above 0");
  if (writing.decimals && *writing.decimals > 0 && is_number && !IsFloat(point.type)) {
    error("decimals",
          "a whole number has none, and '" + point.name + "' is " + std::string(Name(point.type)));
  }
  for (const std::string_view key : {"select", "select_time", "allow_when"}) {
    if (keys.Has(key) && point.access == Access::read) {
      error(key, "'" + point.name + "' can only be read; this key is for points that are written");
    }
  }
  if (keys.Has("select_time") && !writing.select) {
    error("select_time", "needs 'select: yes'");
  }
  if (writing.select && point.modbus && *point.modbus >= kSelectEnd) {
    error("modbus", "'" + point.name + "' is selected before it is written, by register 60000 + " +
                        std::to_string(*point.modbus) +
                        ", which does not exist; give it one below " + std::to_string(kSelectEnd));
  }
}

}  // namespace

void CheckPoint(const Point& point, const Protocol* protocol, const Keys& keys,
                Problems& problems) {
  if (point.table == Table::bits && point.type != Type::boolean) {
    problems.Error(keys.MarkOf("table"), "table: only bool points fit a bit table, and '" +
                                             point.name + "' is " + std::string(Name(point.type)) +
                                             "; write table: input");
  }
  if (!point.write.empty() && point.access == Access::read && !keys.Has("access")) {
    problems.Error(keys.MarkOf("write"),
                   "write: '" + point.name + "' is read-only; add access: rw or remove 'write'");
  }
  if (point.simulate && point.simulate->text && point.simulate->text->size() > point.text_length &&
      point.text_length > 0) {
    problems.Error(keys.MarkOf("simulate"), "simulate: the text is longer than string(" +
                                                std::to_string(point.text_length) + ")");
  }
  CheckArithmetic(point, keys, problems);
  CheckOnFault(point, keys.MarkOf("on_fault"), problems);
  CheckWriting(point, keys, problems);
  const bool complete = !point.read.empty() || !point.write.empty();
  if (!protocol || !complete) return;
  if (const Status status = protocol->check_point(point); !status) {
    problems.Error(keys.MarkOf("read"), "point '" + point.name + "': " + status.error());
  }
}

/// A bit and a register of one address may both be selected, but not by one register.
void RegisterClaims::AddSelect(const Point& point, const Mark& mark) {
  const auto [other, is_new] = selects_.try_emplace(*point.modbus, point.name);
  if (is_new) return;
  problems_.Error(mark, "modbus: '" + point.name + "' and '" + other->second +
                            "' would be selected by one register, 60000 + " +
                            std::to_string(*point.modbus) + "; give one of them another address");
}

void RegisterClaims::Add(const Point& point, const Mark& mark) {
  if (!point.modbus) return;
  const int first = *point.modbus;
  const int count = point.table == Table::bits ? 1 : static_cast<int>(RegisterCount(point));
  const int last = first + count - 1;
  const std::string kind = point.table == Table::bits ? "bit " : "register ";
  if (!IsValueArea(static_cast<std::uint32_t>(first), static_cast<std::uint32_t>(last))) {
    problems_.Error(mark, "modbus: " + kind + RangeText(first, last) + " of '" + point.name +
                              "' is reserved; points live at 0…8999 and 9100…19999");
    return;
  }
  if (point.writing.select) AddSelect(point, mark);
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
  problems_.Error(mark, "modbus: " + kind + RangeText(first, last) + " of '" + point.name +
                            "' overlaps " + RangeText(other_first, other->last) + " of '" +
                            other->name + "' (" + other->mark.ToString() + ")");
}

}  // namespace baudgate::config
