// SPDX-License-Identifier: Apache-2.0
#include "gateway/records/history/log_rule.h"

namespace baudgate::history {
namespace {

bool HasMoved(const Decimal& deadband, const Value& from, const Value& to) {
  if (from == to) return false;
  if (deadband == 0) return true;
  const auto before = Decimal::Of(from);
  const auto now = Decimal::Of(to);
  return !before || !now || Abs(*now - *before) > deadband;
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
