// SPDX-License-Identifier: Apache-2.0
#include "gateway/bus/writes/write_gate.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>
#include <utility>

#include "gateway/base/decimal.h"
#include "gateway/base/shown.h"
#include "gateway/base/text.h"
#include "gateway/bus/points/point_store.h"

namespace baudgate::bus {

namespace {

using config::Type;

Result<Value> ParseFlag(const config::Point& point, std::string_view text) {
  for (const std::string_view yes : {"true", "on", "1"}) {
    if (text == yes) return Value(true);
  }
  for (const std::string_view no : {"false", "off", "0"}) {
    if (text == no) return Value(false);
  }
  return Error{Quoted(text) + " is not a value of '" + point.name +
               "', which is a bool: write on or off"};
}

}  // namespace

Result<Value> ParseValue(const config::Point& point, std::string_view text) {
  if (point.type == Type::boolean) return ParseFlag(point, text);
  if (point.type == Type::string) {
    if (text.size() <= point.text_length) return Value(std::string(text));
    return Error{Quoted(text) + " is longer than the " + std::to_string(point.text_length) +
                 " bytes of '" + point.name + "'"};
  }
  if (const auto whole = ParseInteger<std::int64_t>(text)) return Value(*whole);
  if (const auto whole = ParseInteger<std::uint64_t>(text)) return Value(*whole);
  const auto number = ParseDecimal(text);
  if (number && std::isfinite(*number)) return Value(*number);
  return Error{Quoted(text) + " is not a value of '" + point.name +
               "', which is a number: write for example 1.5"};
}

namespace {

/// Returns the tolerance for rounding errors in a number that a client has computed: 0.1 + 0.2 is
/// 0.30000000000000004. `size`: the largest number in the computation. Zero for whole numbers. At
/// most 0.001, so that a fraction such as 4294967295.4 does not pass as a whole number.
Decimal SlackOf(const Value& value, const Decimal& size) {
  constexpr int kDigits = 13;  // a double has 15
  if (!std::holds_alternative<double>(value)) return Decimal();
  return std::min(Abs(size).Shifted(-kDigits), Decimal(1).Shifted(-3));
}

bool IsMultiple(const Value& value, const Decimal& number, const Decimal& step) {
  if (number.IsMultipleOf(step)) return true;
  const auto steps = (number / step).ToInt64();
  return steps && Abs(number - *steps * step) <= SlackOf(value, std::max(Abs(number), step));
}

}  // namespace

std::string WithUnit(const config::Point& point, const Decimal& number) {
  return number.ToText() + (point.unit.empty() ? "" : " " + point.unit);
}

Value AsMeant(const config::Point& point, const Value& value) {
  const auto* number = std::get_if<double>(&value);
  if (number == nullptr || point.type != config::Type::float32) return value;
  return AsDecimal(*number);
}

Result<PointWrite> Convert(const config::Point& point, std::uint32_t index, const Value& value) {
  auto raw = ToRaw(point, value);
  if (!raw) return Error{raw.error()};
  Value shown = ToSample(point, {index, *raw}).value;
  return PointWrite{.point = index, .raw = *std::move(raw), .shown = std::move(shown)};
}

std::optional<std::string> WhyInexact(const config::Point& point, const Value& value,
                                      const PointWrite& write) {
  if (!HasValue(write.shown))
    return ToText(value) +
           " is a code of this device and not a value ('sentinels'), so it cannot be written";
  auto number = Decimal::Of(value);
  if (!number) return std::nullopt;  // a text
  if (point.type == config::Type::float32) number = Decimal(NearestSingle(number->ToDouble()));
  const Decimal difference = Abs(Decimal::Of(write.shown).value_or(0) - *number);
  if (difference > SlackOf(value, Abs(*number) + Abs(point.offset))) {
    return "the device cannot represent " + number->ToText() + "; the nearest value is " +
           ToText(write.shown);
  }
  const auto digits = Decimal::Of(write.raw);
  if (!point.writing.decimals || !digits) return std::nullopt;
  if (IsMultiple(write.raw, *digits, Decimal(1).Shifted(-*point.writing.decimals))) {
    return std::nullopt;
  }
  return number->ToText() + " has more digits than the device takes (" +
         std::to_string(*point.writing.decimals) + " after the decimal point)";
}

std::optional<std::string> WhyOutside(const config::Point& point, const Value& value) {
  const config::Writing& writing = point.writing;
  const auto number = Decimal::Of(value);
  if (!number) {
    if (std::holds_alternative<std::string>(value)) return std::nullopt;
    return "the value is not a number";
  }
  const bool single = point.type == config::Type::float32;
  const double size = Abs(*number).ToDouble();
  if (single && size != 0 && size < std::numeric_limits<float>::min()) {
    return number->ToText() + " is almost zero: check the word order of the float";
  }
  if (writing.min && *number < *writing.min) {
    return number->ToText() + " is below the minimum, " + WithUnit(point, *writing.min);
  }
  if (writing.max && *number > *writing.max) {
    return number->ToText() + " is above the maximum, " + WithUnit(point, *writing.max);
  }
  if (!writing.step || IsMultiple(value, *number, *writing.step)) return std::nullopt;
  return number->ToText() + " is not a multiple of " + WithUnit(point, *writing.step);
}

namespace {

bool Same(const Value& a, const Value& b) {
  if (std::holds_alternative<std::string>(a) || std::holds_alternative<std::string>(b)) {
    return ToText(a) == ToText(b);
  }
  const auto number = Decimal::Of(b);
  return number && IsMeant(a, *number);
}

}  // namespace

std::optional<std::string> WhyLocked(const PointStore& store, const config::Point& point,
                                     const Value& written, Instant now) {
  for (const config::AllowWhen& interlock : point.writing.allow_when) {
    if (HasValue(interlock.only) && !Same(written, interlock.only)) continue;
    Value value;
    Quality quality;
    store.Read(interlock.device, [&](const DeviceRecord& record) {
      value = record.points[interlock.index].value;
      quality = QualityAt(record, interlock.index, now);
    });
    if (IsGood(quality) && Same(value, interlock.is)) continue;
    const std::string is =
        IsGood(quality) ? "is " + ToText(value) : "is " + std::string(Name(quality));
    return "'" + point.name + "' is locked by allow_when: " + interlock.point + " " + is +
           ", but must be " + ToText(interlock.is);
  }
  return std::nullopt;
}

std::optional<Beyond> WhyBeyond(const PointStore& store, std::uint32_t device,
                                const config::Point& point, const Value& value, Instant now) {
  const auto number = Decimal::Of(value);
  const auto judge = [&](const std::string& name, bool is_max) -> std::optional<Beyond> {
    if (name.empty()) return std::nullopt;
    const std::string what = is_max ? "maximum" : "minimum";
    std::optional<Decimal> limit;
    Quality quality = Quality::bad_configuration;
    store.Read(device, [&](const DeviceRecord& record) {
      const auto& points = record.device->points;
      const auto found = std::ranges::find(points, name, &config::Point::name);
      if (found == points.end()) return;
      const auto index = static_cast<std::size_t>(found - points.begin());
      quality = QualityAt(record, index, now);
      limit = Decimal::Of(record.points[index].value);
    });
    if (!limit || !IsGood(quality)) {
      return Beyond{false, "'" + point.name + "': its " + what + " is not known, because " + name +
                               " is " + Name(quality)};
    }
    if (!number || (is_max ? *number <= *limit : *number >= *limit)) return std::nullopt;
    return Beyond{true, "'" + point.name + "': " + number->ToText() + " is " +
                            (is_max ? "above" : "below") + " the " + what + ", " +
                            WithUnit(point, *limit) + " (" + name + ")"};
  };
  auto beyond = judge(*point.writing.max_point, true);
  return beyond ? beyond : judge(*point.writing.min_point, false);
}

bool IsGuarded(const config::Point& point) {
  return !point.writing.allow_when.empty() || point.writing.min_point || point.writing.max_point;
}

std::optional<std::string> WhyChanged(const PointStore& store, std::uint32_t device,
                                      std::uint32_t point, const std::string& expect) {
  std::string name;
  Value value;
  std::string text;
  bool is_known = true;
  store.Read(device, [&](const DeviceRecord& record) {
    const PointRecord& held = record.points[point];
    const config::Point& its = record.device->points[point];
    name = its.name;
    value = held.value;
    text = its.states ? config::ShownText(its, value) : ToText(AsMeant(its, value));
    const bool is_read = !held.written_at || (held.read_at && *held.read_at > *held.written_at);
    // A point that has no value is perhaps never read.
    is_known = is_read || its.access == config::Access::write || !HasValue(value);
  });
  if (!is_known) {
    return "'" + name + "' was written meanwhile, and its new value has not been read yet";
  }
  const auto number = Decimal::Parse(expect);
  if (ToText(value) == expect || (number && IsMeant(value, *number))) return std::nullopt;
  return "'" + name + "': the value has changed meanwhile to " +
         (HasValue(value) ? text : "none: the point has no value now");
}

void Selections::Select(std::uint64_t client, Point point, Instant until) {
  until_[{point, client}] = until;
  if (until_.size() <= kLimit) return;
  until_.erase(std::ranges::min_element(until_, {}, [](const auto& one) { return one.second; }));
}

Selections::Verdict Selections::Take(std::uint64_t client, Point point, Instant now) {
  const auto own = until_.find({point, client});
  if (own != until_.end()) {
    const bool in_time = now < own->second;
    until_.erase(own);
    return in_time ? Verdict::selected : Verdict::expired;
  }
  for (auto one = until_.lower_bound({point, 0}); one != until_.end(); ++one) {
    if (one->first.point != point) break;
    if (now < one->second) return Verdict::foreign;
  }
  return Verdict::none;
}

void Selections::Forget(std::uint64_t client) {
  std::erase_if(until_, [client](const auto& one) { return one.first.client == client; });
}

namespace {

using Why = WriteDenial::Why;

std::string NotSelected(Selections::Verdict verdict, const config::Point& point) {
  switch (verdict) {
    case Selections::Verdict::foreign:
      return "'" + point.name +
             "' is selected by another client; select it again when the selection of the other "
             "client has ended";
    case Selections::Verdict::expired:
      return "the selection of '" + point.name + "' ended " +
             FormatDuration(point.writing.select_time) + " after it was made; select it again";
    default:
      return "'" + point.name + "' has to be selected before it is written";
  }
}

WriteDenial Gone() { return {Why::locked, "a reload has removed the device"}; }

/// Returns the first limit or interlock that forbids one of the parts now; empty: all parts are
/// allowed.
std::optional<WriteDenial> WhyNotNow(const PointStore& store, std::uint32_t device,
                                     const std::vector<WriteAsk::Part>& parts, Instant now) {
  const auto its = store.device(device);
  if (!its) return Gone();
  for (const WriteAsk::Part& part : parts) {
    const config::Point& point = its->points[part.point];
    if (auto beyond = WhyBeyond(store, device, point, part.value, now)) {
      return WriteDenial{beyond->known ? Why::value : Why::locked, std::move(beyond->text)};
    }
    if (auto why = WhyLocked(store, point, part.value, now)) {
      return WriteDenial{Why::locked, std::move(*why)};
    }
    if (!part.expect) continue;
    if (auto why = WhyChanged(store, device, part.point, *part.expect)) {
      return WriteDenial{Why::changed, std::move(*why)};
    }
  }
  return std::nullopt;
}

}  // namespace

std::optional<WriteDenial> WriteGate::Submit(const Writer& writer, WriteAsk ask, Instant now) {
  const auto device = store_.device(ask.device);
  if (!device) return Gone();
  RestoreDecimals(*device, ask);
  WriteCommand command;
  auto& writes = command.kind.emplace<Writes>();
  if (auto denial = CheckAndConvert(writer, *device, ask, now, writes)) {
    Deny(writer, ask, denial->text);
    return denial;
  }
  command.device = ask.device;
  command.client = writer.name;
  command.request = std::move(ask.request);
  command.deadline = ask.deadline;
  command.abandoned = ask.abandoned;
  command.done = std::move(ask.done);
  store_.Read(ask.device, [&](const DeviceRecord& record) {
    for (PointWrite& write : writes) write.before = KnownValue(record, write.point, now);
  });
  std::erase_if(ask.parts, [&points = device->points](const auto& part) {
    return !IsGuarded(points[part.point]) && !part.expect;
  });
  if (!ask.parts.empty()) {
    command.why_not = [&store = store_, device = ask.device,
                       guarded = std::move(ask.parts)](Instant at) -> std::optional<Withheld> {
      auto denial = WhyNotNow(store, device, guarded, at);
      if (!denial) return std::nullopt;
      return Withheld{WriteEnd::denied, std::move(denial->text), denial->why == Why::changed};
    };
  }
  if (sink_.Submit(std::move(command))) return std::nullopt;
  return WriteDenial{Why::busy, "not sent, because too many writes wait for this line; try again"};
}

void WriteGate::RestoreDecimals(const config::Device& device, WriteAsk& ask) {
  for (WriteAsk::Part& part : ask.parts) {
    part.value = AsMeant(device.points[part.point], part.value);
  }
}

std::optional<WriteDenial> WriteGate::WouldDeny(const WriteAsk& ask, Instant now) const {
  const auto device = store_.device(ask.device);
  if (!device) return Gone();
  WriteAsk meant = ask;
  RestoreDecimals(*device, meant);
  Writes unused;
  if (auto denial = ConvertValues(*device, meant, unused)) return denial;
  return WhyNotNow(store_, meant.device, meant.parts, now);
}

std::optional<WriteDenial> WriteGate::CheckAndConvert(const Writer& writer,
                                                      const config::Device& device,
                                                      const WriteAsk& ask, Instant now,
                                                      Writes& writes) {
  // Checked first, because the first try uses up a selection even if another rule denies the write.
  const std::optional<std::string> not_selected = WhyNotSelected(writer, device, ask, now);
  if (auto denial = ConvertValues(device, ask, writes)) return denial;
  if (not_selected) return WriteDenial{Why::not_selected, *not_selected};
  return WhyNotNow(store_, ask.device, ask.parts, now);
}

/// Checks that each point can be written and its value is allowed, and converts the values.
std::optional<WriteDenial> WriteGate::ConvertValues(const config::Device& device,
                                                    const WriteAsk& ask, Writes& writes) {
  for (const WriteAsk::Part& part : ask.parts) {
    const config::Point& point = device.points[part.point];
    if (point.writing.allowed) continue;
    return WriteDenial{
        Why::read_only,
        point.access == config::Access::read
            ? "'" + point.name + "' can only be read"
            : "'" + point.name +
                  "' may not be written: add it to 'write' of the device in the configuration"};
  }
  for (const WriteAsk::Part& part : ask.parts) {
    const config::Point& point = device.points[part.point];
    auto write = Convert(point, part.point, part.value);
    std::optional<std::string> why = write ? WhyOutside(point, part.value) : write.error();
    if (!why) why = WhyInexact(point, part.value, *write);
    if (why) return WriteDenial{Why::value, "'" + point.name + "': " + *why};
    writes.push_back(*std::move(write));
  }
  return std::nullopt;
}

/// Checks and removes the selection of each point. Returns the first reason why one is not
/// selected; empty: all are selected.
std::optional<std::string> WriteGate::WhyNotSelected(const Writer& writer,
                                                     const config::Device& device,
                                                     const WriteAsk& ask, Instant now) {
  std::optional<std::string> why;
  for (const WriteAsk::Part& part : ask.parts) {
    const config::Point& point = device.points[part.point];
    if (!point.writing.select) continue;
    const auto verdict = selections_.Take(writer.number, {ask.device, part.point}, now);
    if (verdict == Selections::Verdict::selected || ask.without_selection || why) continue;
    why = NotSelected(verdict, point);
  }
  return why;
}

std::optional<WriteDenial> WriteGate::Select(const Writer& writer, std::uint32_t device,
                                             std::uint32_t point, Instant now) {
  const auto its = store_.device(device);
  if (!its) return Gone();
  const config::Point& selected = its->points[point];
  if (!selected.writing.allowed) {
    return WriteDenial{
        Why::read_only,
        "'" + selected.name +
            "' may not be written: add it to 'write' of the device in the configuration"};
  }
  selections_.Select(writer.number, {device, point}, now + selected.writing.select_time);
  return std::nullopt;
}

void WriteGate::Deny(const Writer& writer, const WriteAsk& ask, const std::string& reason,
                     WriteEnd end) {
  bool first = true;
  for (const WriteAsk::Part& part : ask.parts) {
    sink_.OnNotTaken(
        {writer.name, ask.request, ask.device, part.point, part.value, reason, end, first});
    first = false;
  }
}

}  // namespace baudgate::bus
