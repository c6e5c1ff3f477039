// SPDX-License-Identifier: Apache-2.0
#include "config/checks/point_checks.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>
#include <string_view>

#include "config/checks/modbus_checks.h"
#include "config/model/modbus.h"
#include "gateway/base/text.h"

namespace baudgate::config {

namespace {

using Kind = RawNumbers::Kind;

/// Converts bits to a signed number: 0x8000 becomes -32768 in the range of 16 bits.
Decimal OfBits(const Decimal& number, const IntegerRange& range) {
  const Decimal meant = number - range.highest - range.highest - 2;
  return range.lowest < 0 && number > range.highest && meant.is_negative() ? meant : number;
}

bool IsHex(const Sentinel& sentinel) {
  return sentinel.written.substr(0, 2).find_first_of("xX") == 1;
}

/// Returns why the device never sends this sentinel, as the end of a sentence that begins with the
/// number; empty if the device can send it.
std::string WhyNever(const Sentinel& sentinel, const RawNumbers& numbers) {
  const bool is_real = numbers.kind == Kind::single || numbers.kind == Kind::real;
  if (is_real && IsHex(sentinel)) {
    return "is in hex, but the point reads a float; write a decimal number, such as -999.9 or 1e30";
  }
  if (numbers.Contain(sentinel.value)) return {};
  if (numbers.kind == Kind::single) {
    const double nearest = NearestSingle(sentinel.value.ToDouble());
    return "is not a float32 number, so the device never sends it" +
           (std::isfinite(nearest) ? "; write the nearest, " + FormatNumber(nearest)
                                   : std::string());
  }
  const auto& [lowest, highest] = numbers.range;
  const Decimal meant = OfBits(sentinel.value, numbers.range);
  return "can never match: the device sends whole numbers " + std::to_string(lowest) + "…" +
         std::to_string(highest) + ", before scale and offset" +
         (numbers.Contain(meant) ? "; write " + meant.ToText() : "");
}

void Resolve(Point& point, const RawNumbers& numbers, Problems& problems) {
  const IntegerRange& range = numbers.range;
  // A number that is read as decimal text has no bits, so the type of the point gives the meaning
  // of a hex sentinel.
  const bool has_bits =
      numbers.kind == Kind::whole && (range.lowest == 0 || Decimal(range.highest).ToInt64());
  const IntegerRange bits = has_bits ? range : RangeOf(point.type);
  for (std::size_t i = 0; i < point.sentinels.size(); ++i) {
    Sentinel& sentinel = point.sentinels[i];
    if (IsHex(sentinel)) sentinel.value = OfBits(sentinel.value, bits);
    std::string why = WhyNever(sentinel, numbers);
    for (std::size_t other = 0; other < i && why.empty(); ++other) {
      if (point.sentinels[other].value == sentinel.value) why = "occurs twice";
    }
    if (!why.empty()) problems.Error(sentinel.mark, "sentinels: " + sentinel.written + " " + why);
  }
}

}  // namespace

void ResolveSentinels(Device& device, const protocols::Protocol* protocol, Problems& problems) {
  const bool asks = protocol != nullptr && protocol->raw_numbers != nullptr;
  for (Point& point : device.points) {
    if (point.sentinels.empty() || point.type == Type::string) continue;
    Resolve(point, asks ? protocol->raw_numbers(device, point) : RawNumbers(), problems);
  }
}

namespace {

bool IsNumber(const Point& point) {
  return point.type != Type::string && point.type != Type::boolean;
}

bool IsFloat(Type type) { return type == Type::float32 || type == Type::float64; }

bool Fits(const Point& point, const Decimal& number) {
  const Type type = point.type;
  if (type == Type::float32) return Abs(number).ToDouble() <= std::numeric_limits<float>::max();
  if (type == Type::float64) return true;
  return number.is_whole() && RangeOf(point).Contains(number);
}

void CheckOnFault(const Point& point, const Keys& keys, Problems& problems) {
  using Kind = OnFault::Kind;
  const OnFault& fault = point.on_fault;
  const std::string type(Name(point.type));
  const auto error = [&](const std::string& text) {
    problems.Error(keys.MarkOf("on_fault"), "on_fault: " + text);
  };
  if (fault.kind == Kind::nan && !IsFloat(point.type)) {
    error("nan needs a float type, but '" + point.name + "' is " + type +
          "; write hold or a number");
  } else if (fault.kind == Kind::value &&
             (point.type == Type::string || !Fits(point, fault.value))) {
    error(fault.value.ToText() + " does not fit type " + type +
          "; write hold, or a number that fits");
  } else if (fault.kind != Kind::automatic && !point.modbus && keys.Has("on_fault")) {
    error("the key sets what Modbus registers show, but '" + point.name +
          "' has no register; add 'modbus' to the point, or remove 'on_fault'");
  }
}

void CheckArithmetic(const Point& point, const Keys& keys, Problems& problems) {
  const bool is_number = IsNumber(point);
  if (point.scale == 0) {
    problems.Error(
        keys.MarkOf("scale"),
        "scale: 0 would make every value the same; write another number, or remove the key");
  }
  if (!is_number && point.scale != 1) {
    problems.Error(keys.MarkOf("scale"), "scale: only numbers can be scaled, but '" + point.name +
                                             "' is " + std::string(Name(point.type)) +
                                             "; remove the key");
  }
  if (!is_number && point.offset != 0) {
    problems.Error(keys.MarkOf("offset"), "offset: only numbers can have an offset, but '" +
                                              point.name + "' is " + std::string(Name(point.type)) +
                                              "; remove the key");
  }
  if (is_number && !IsFloat(point.type)) {
    for (const auto& [key, number] :
         {std::pair{"scale", &point.scale}, {"offset", &point.offset}}) {
      if (!keys.Has(key) || number->is_whole()) continue;
      problems.Warning(keys.MarkOf(key), std::string(key) + ": '" + point.name + "' is " +
                                             std::string(Name(point.type)) +
                                             ", so decimals are rounded away; write type: float32, "
                                             "and put the device's own type in 'read'");
    }
  }
  if (point.jump && (*point.jump < 0 || !is_number)) {
    problems.Error(keys.MarkOf("jump"),
                   is_number ? "jump: must not be negative; write 0 or more"
                             : "jump: only numbers can have a jump, but '" + point.name + "' is " +
                                   std::string(Name(point.type)) + "; remove the key");
  }
  if (keys.Has("deadband") && !is_number) {
    problems.Error(keys.MarkOf("deadband"), "deadband: only numbers can have a deadband, but '" +
                                                point.name + "' is " +
                                                std::string(Name(point.type)) + "; remove the key");
  }
  if (point.jump && point.recheck == Recheck::off && keys.Has("recheck")) {
    problems.Error(keys.MarkOf("jump"),
                   "jump: has no effect with recheck: off; remove jump or recheck: off");
  }
  if (point.deadband < 0) {
    problems.Error(keys.MarkOf("deadband"), "deadband: must not be negative; write 0 or more");
  }
  if (point.type == Type::string && !point.sentinels.empty()) {
    problems.Error(keys.MarkOf("sentinels"),
                   "sentinels: a string point cannot have sentinels; remove the key");
  }
}

void CheckShown(const Point& point, const Keys& keys, Problems& problems) {
  const auto error = [&](std::string_view key, const std::string& text) {
    problems.Error(keys.MarkOf(key), std::string(key) + ": " + text);
  };
  const std::string type(Name(point.type));
  const bool is_float = IsFloat(point.type);
  if (point.precision && !is_float && (!IsNumber(point) || *point.precision > 0)) {
    error("precision",
          "only floats have decimals, but '" + point.name + "' is " + type + "; remove the key");
  }
  if (!keys.Has("states")) return;
  if (is_float || point.type == Type::string) {
    return error("states", "only values of an integer or bool can have texts, but '" + point.name +
                               "' is " + type + "; remove the key");
  }
  for (const StateText& state : *point.states) {
    if (RangeOf(point).Contains(state.value)) continue;
    error("states", std::to_string(state.value) + " is no value of type " + type);
  }
}

/// Reports keys that do not fit the point's access. A configuration may make a profile's point
/// read-only with `access: r`; the profile's own keys for writing are then no error.
void CheckAccess(const Point& point, const Keys& keys, Problems& problems) {
  const auto stays = [&](std::string_view key) {
    return keys.Has("access") && *keys.MarkOf("access").file != *keys.MarkOf(key).file;
  };
  if (point.access == Access::read) {
    for (const std::string_view key :
         {"write", "step", "decimals", "select", "select_time", "allow_when"}) {
      if (!keys.Has(key) || stays(key)) continue;
      problems.Error(keys.MarkOf(key), std::string(key) + ": '" + point.name +
                                           "' can only be read, but this key is for points that "
                                           "are written; add access: rw or remove '" +
                                           std::string(key) + "'");
    }
  }
  if (point.access != Access::write) return;
  for (const std::string_view key : {"poll", "deadband", "jump", "recheck", "events", "on_fault"}) {
    if (!keys.Has(key)) continue;
    problems.Error(keys.MarkOf(key),
                   std::string(key) + ": '" + point.name +
                       "' can only be written, but this key is for points that are read; remove '" +
                       std::string(key) + "'");
  }
}

void CheckWriting(const Point& point, const Keys& keys, Problems& problems) {
  const Writing& writing = point.writing;
  const bool is_number = IsNumber(point);
  const auto error = [&](std::string_view key, const std::string& text) {
    problems.Error(keys.MarkOf(key), std::string(key) + ": " + text);
  };
  for (const std::string_view key : {"min", "max", "step", "decimals"}) {
    if (keys.Has(key) && !is_number) {
      error(key, "only numbers can have this key, but '" + point.name + "' is " +
                     std::string(Name(point.type)) + "; remove the key");
    }
  }
  if (writing.min && writing.max && *writing.min > *writing.max) {
    error("min", writing.min->ToText() + " is above max (" + writing.max->ToText() + ")");
  }
  if (is_number && !IsFloat(point.type)) {
    if (writing.min && *writing.min > RangeOf(point).highest) {
      error("min", writing.min->ToText() + " is above every value that " +
                       std::string(Name(point.type)) + " can hold; write a smaller number");
    }
    if (writing.max && *writing.max < RangeOf(point).lowest) {
      error("max", writing.max->ToText() + " is below every value that " +
                       std::string(Name(point.type)) + " can hold; write a larger number");
    }
  }
  if (writing.step && *writing.step <= 0) error("step", "must be above 0");
  if (writing.decimals && *writing.decimals > 0 && is_number && !IsFloat(point.type)) {
    error("decimals", "'" + point.name + "' is " + std::string(Name(point.type)) +
                          ", which has no decimals; remove the key");
  }
  CheckAccess(point, keys, problems);
  if (keys.Has("select_time") && !writing.select) {
    error("select_time", "needs 'select: yes'");
  }
  if (writing.select && point.modbus && *point.modbus >= kSelectEnd) {
    error("modbus", "'" + point.name +
                        "' is selected before it is written, but its select register 60000 + " +
                        std::to_string(*point.modbus) +
                        " does not exist; use a modbus address below " +
                        std::to_string(kSelectEnd));
  }
}

}  // namespace

void CheckPoint(const Point& point, const protocols::Protocol* protocol, const Keys& keys,
                Problems& problems) {
  if (point.table == Table::bits && point.type != Type::boolean) {
    problems.Error(keys.MarkOf("table"), "table: only bool points fit a bit table, but '" +
                                             point.name + "' is " + std::string(Name(point.type)) +
                                             "; write table: input");
  } else if (!point.modbus && keys.Has("table")) {
    problems.Error(
        keys.MarkOf("table"),
        "table: '" + point.name +
            "' has no Modbus address, so it is in no table; add 'modbus', or remove 'table'");
  }
  if (point.simulate && point.simulate->text && point.simulate->text->size() > point.text_length &&
      point.text_length > 0) {
    problems.Error(keys.MarkOf("simulate"), "simulate: the text is longer than string(" +
                                                std::to_string(point.text_length) +
                                                "); write a shorter text");
  }
  CheckArithmetic(point, keys, problems);
  CheckOnFault(point, keys, problems);
  CheckShown(point, keys, problems);
  CheckWriting(point, keys, problems);
  const bool complete = !point.read.empty() || !point.write.empty();
  if (!protocol || !complete) return;
  if (const Status status = protocol->check_point(point); !status) {
    problems.Error(keys.MarkOf("read"), "point '" + point.name + "': " + status.error());
  }
}

void CheckLimitPoints(const std::vector<Point>& points, Problems& problems) {
  std::vector<std::string_view> names;
  for (const Point& point : points) names.emplace_back(point.name);
  const auto check = [&](const Point& point, std::string_view key, const std::string& name) {
    if (name.empty()) return;
    const auto error = [&](const std::string& text) {
      problems.Error(point.mark, std::string(key) + ": " + text);
    };
    const auto found = std::ranges::find(points, name, &Point::name);
    if (found == points.end()) {
      return error(Quoted(name) + " is neither a number nor a point of this device;" +
                   DidYouMean(name, names) + " write for example " + std::string(key) + ": 50");
    }
    if (point.access == Access::read) {
      return error("'" + point.name +
                   "' is never written, so a point cannot be its limit; write a number");
    }
    if (&*found == &point)
      return error("'" + name + "' cannot be its own limit; write a number or another point");
    if (found->access == Access::write) {
      return error("'" + name +
                   "' cannot be read, so it cannot be a limit; write a number or another point");
    }
    if (!IsNumber(*found))
      error("'" + name + "' is " + std::string(Name(found->type)) + ", not a number");
    if (found->unit != point.unit) {
      error("'" + name + "' is in " + Quoted(found->unit) + ", but '" + point.name + "' is in " +
            Quoted(point.unit) + "; both points need the same unit");
    }
  };
  for (const Point& point : points) {
    check(point, "min", *point.writing.min_point);
    check(point, "max", *point.writing.max_point);
  }
}

/// Claims a select register. A bit and a register can have the same address, but only one of them
/// can have a select register.
void RegisterClaims::AddSelect(const Point& point, const Mark& mark) {
  const auto [other, is_new] = selects_.try_emplace(*point.modbus, point.name);
  if (is_new) return;
  problems_.Error(mark, "modbus: '" + point.name + "' and '" + other->second +
                            "' would share the select register 60000 + " +
                            std::to_string(*point.modbus) +
                            "; give one of the points another modbus address");
}

void RegisterClaims::Add(const Point& point, const Mark& mark) {
  if (!point.modbus) return;
  const int first = *point.modbus;
  const int count = point.table == Table::bits ? 1 : static_cast<int>(RegisterCount(point));
  const int last = first + count - 1;
  const std::string kind = point.table == Table::bits ? "bit " : "register ";
  if (!IsValueArea(static_cast<std::uint32_t>(first), static_cast<std::uint32_t>(last))) {
    problems_.Error(mark, "modbus: " + kind + RangeText(first, last) + " of '" + point.name +
                              "' is reserved; points can use 0…8999 and 9100…19999");
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
                            other->name + "' (" + other->mark.ToString() +
                            "); give one of the points another address");
}

}  // namespace baudgate::config
