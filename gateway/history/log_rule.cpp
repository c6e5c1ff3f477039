// SPDX-License-Identifier: Apache-2.0
#include "gateway/history/log_rule.h"

#include <cmath>

namespace baudgate::history {
namespace {

bool IsNumber(const Value& value) {
  return HasValue(value) && !std::holds_alternative<std::string>(value);
}

bool HasMoved(double deadband, const Value& from, const Value& to) {
  if (from == to) return false;
  if (deadband <= 0 || !IsNumber(from) || !IsNumber(to)) return true;
  // Not "greater": an infinite difference to itself is no number.
  return !(std::abs(ToDouble(to) - ToDouble(from)) <= deadband);
}

}  // namespace

LogRule LogRule::Of(const config::HistoryPoint& point) {
  return {point.every, point.deadband, point.max_gap / std::chrono::milliseconds(1)};
}

bool IsKept(const LogRule& rule, const Entry* last, const Entry& now) {
  if (last == nullptr || rule.every || now.quality != last->quality) return true;
  if (now.time - last->time >= rule.max_gap) return true;
  return HasMoved(rule.deadband, last->value, now.value);
}

}  // namespace baudgate::history
