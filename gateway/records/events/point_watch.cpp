// SPDX-License-Identifier: Apache-2.0
#include "gateway/records/events/point_watch.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <limits>
#include <string_view>
#include <utility>

#include "config/model/fields.h"
#include "gateway/base/shown.h"
#include "gateway/base/text.h"
#include "gateway/records/events/own_records.h"

namespace baudgate::events {
namespace {

using On = config::PointEvent::On;
using config::EventState;

OwnCode CodeOfRule(On on) {
  if (on == On::above) return OwnCode::point_above;
  return on == On::below ? OwnCode::point_below : OwnCode::point_change;
}

AlarmMark::Step StepOf(EventState state) {
  if (state == EventState::message) return AlarmMark::Step::pulse;
  return state == EventState::on ? AlarmMark::Step::raise : AlarmMark::Step::clear;
}

/// Rounds a double to the 15 decimal digits that it represents exactly. Example: 53 * 0.1 is 5.3,
/// not 5.300000000000001.
std::optional<Decimal> NumberOf(const Value& value) {
  const auto* number = std::get_if<double>(&value);
  if (number == nullptr || !std::isfinite(*number)) return Decimal::Of(value);
  constexpr int kDigits = std::numeric_limits<double>::digits10;
  std::array<char, 32> text{};
  const auto end = std::to_chars(text.data(), text.data() + text.size(), *number,
                                 std::chars_format::scientific, kDigits - 1);
  double meant = *number;
  std::from_chars(text.data(), end.ptr, meant);
  return Decimal(meant);
}

}  // namespace

std::optional<PointWatch::Transition> PointWatch::Take(const Value& value, Quality quality,
                                                       Instant now) {
  const bool is_text = std::holds_alternative<std::string>(value);
  const auto number = NumberOf(value);
  if (IsBad(quality) || (!is_text && !number)) return std::nullopt;
  if (rule_.on == On::change) return Change(value, now);
  return number ? Compare(*number, now) : std::nullopt;
}

void PointWatch::GoOn(const PointWatch& before) {
  if (!config::Same(rule_, before.rule_)) return;
  told_ = before.told_;
  seen_ = before.seen_;
  since_ = before.since_;
}

std::optional<PointWatch::Transition> PointWatch::Compare(const Decimal& value, Instant now) {
  const bool below = rule_.on == On::below;
  const bool beyond = below ? value < rule_.value : value > rule_.value;
  const bool back =
      below ? value >= rule_.value + rule_.hysteresis : value <= rule_.value - rule_.hysteresis;
  const Value is = beyond ? Value(true) : back ? Value(false) : told_;
  if (is == told_) {
    since_.reset();
    return std::nullopt;
  }
  if (!Lasts(is, now)) return std::nullopt;
  const bool first = !HasValue(std::exchange(told_, is));
  const bool alarm = rule_.alarm != config::AlarmPriority::none;
  if (first && !beyond && !alarm) return std::nullopt;
  return Transition{beyond ? EventState::on : EventState::off, first && alarm};
}

std::optional<PointWatch::Transition> PointWatch::Change(const Value& value, Instant now) {
  const bool* const flag = std::get_if<bool>(&value);
  const bool alarm = rule_.alarm != config::AlarmPriority::none;
  const bool first = !HasValue(told_);
  if (!first && IsSame(value, told_)) {
    since_.reset();
    return std::nullopt;
  }
  if (!Lasts(value, now)) return std::nullopt;
  told_ = value;
  const bool has_normal = !rule_.normal.empty();
  const bool beyond = has_normal ? !IsNormal(value) : flag != nullptr && *flag;
  const bool two_states = has_normal || flag != nullptr;
  if (first && !(two_states && alarm) && !(has_normal && beyond)) return std::nullopt;
  if (!two_states) return Transition{EventState::message, false};
  return Transition{beyond ? EventState::on : EventState::off, first && alarm};
}

/// Compares `value` with the normal value as text and as number: "0" also matches 0.0.
bool PointWatch::IsNormal(const Value& value) const {
  if (ToText(value) == rule_.normal) return true;
  const auto normal = Decimal::Parse(rule_.normal);
  return normal && IsMeant(value, *normal);
}

bool PointWatch::IsSame(const Value& a, const Value& b) const {
  if (a == b || rule_.on != On::change || rule_.hysteresis == 0) return a == b;
  const auto now = NumberOf(a);
  const auto before = NumberOf(b);
  return now && before && Abs(*now - *before) <= rule_.hysteresis;
}

bool PointWatch::Lasts(const Value& seen, Instant now) {
  if (!since_ || !IsSame(seen, seen_)) {
    since_ = now;
    seen_ = seen;
  }
  if (now - *since_ < rule_.delay) return false;
  since_.reset();
  return true;
}

std::string SubjectOf(const config::Point& point, const config::PointEvent& event) {
  return point.name + " " + ConditionOf(event);
}

DeviceWatch::DeviceWatch(std::string line, std::shared_ptr<const config::Device> device)
    : line_(std::move(line)), device_(std::move(device)) {
  for (std::size_t i = 0; i < device_->points.size(); ++i) {
    for (const config::PointEvent& event : device_->points[i].events) {
      rules_[static_cast<std::uint32_t>(i)].push_back({event, PointWatch(event)});
    }
  }
}

void DeviceWatch::GoOn(const DeviceWatch& before) {
  std::map<std::string_view, const std::vector<Rule>*> known;
  for (const auto& [point, rules] : before.rules_) {
    known.emplace(before.device_->points[point].name, &rules);
  }
  for (auto& [point, rules] : rules_) {
    const auto its = known.find(device_->points[point].name);
    if (its == known.end()) continue;
    for (std::size_t i = 0; i < std::min(rules.size(), its->second->size()); ++i) {
      rules[i].watch.GoOn((*its->second)[i].watch);
    }
  }
}

std::vector<EventRecord> DeviceWatch::Take(std::uint32_t point, const Value& value, Quality quality,
                                           Now at) {
  std::vector<EventRecord> records;
  const auto rules = rules_.find(point);
  if (rules == rules_.end()) return records;
  for (Rule& rule : rules->second) {
    const auto found = rule.watch.Take(value, quality, at.instant);
    if (!found) continue;
    records.push_back(RecordOf(device_->points[point], rule.event, *found, value, at));
  }
  return records;
}

/// Makes an event. Examples of its text: "current_l1 5.3 A: above 5", "current_l1 4.8 A:
/// overcurrent, over", "closed true".
EventRecord DeviceWatch::RecordOf(const config::Point& point, const config::PointEvent& event,
                                  const PointWatch::Transition& found, const Value& value,
                                  Now at) const {
  EventRecord record;
  record.received = record.device_time = at.wall;
  record.clock = ClockQuality::gateway;
  record.line = line_;
  record.device = device_->name;
  record.code = CodeOf(CodeOfRule(event.on));
  record.state = found.state;
  // Without `precision` and `states` the text has all digits, so that it shows why the value is
  // beyond the limit.
  const bool shown = point.precision || point.states;
  record.text = point.name + " " + Harmless(shown ? ShownText(point, value) : ToText(value)) +
                (point.unit.empty() ? "" : " " + point.unit);
  const bool change = event.on == On::change;
  if (!event.text.empty() || !change) {
    record.text += ": " + (event.text.empty() ? ConditionOf(event) : event.text);
    if (!change && found.state == EventState::off) record.text += ", over";
  }
  Shorten(record.text);
  record.subject = SubjectOf(point, event);
  if (found.state != config::EventState::off) record.record = event.record;
  if (event.alarm != config::AlarmPriority::none) {
    record.mark = {.step = StepOf(found.state),
                   .priority = event.alarm,
                   .point = point.name,
                   .first = found.first};
  }
  return record;
}

}  // namespace baudgate::events
