// SPDX-License-Identifier: Apache-2.0
#include "gateway/bus/devices/jump_check.h"

#include <algorithm>
#include <utility>

namespace baudgate {

bool JumpCheck::Agree(const config::Point& point, const History& history, const Value& a,
                      const Value& b) {
  if (!HasValue(a)) return false;
  if (point.type == config::Type::boolean || point.type == config::Type::string) return a == b;
  const auto first = Decimal::Of(a);
  const auto second = Decimal::Of(b);
  if (!first || !second) return false;
  Decimal jump = std::max(Abs(*first).Shifted(-1), history.largest.Shifted(-2));
  if (const config::Writing& range = point.writing; range.min && range.max) {
    jump = (*range.max - *range.min).Shifted(-1);
  }
  return Abs(*first - *second) <= point.jump.value_or(jump);
}

JumpCheck::Finding JumpCheck::Judge(const config::Point& point, History& history,
                                    const Value& value) const {
  const bool near = Agree(point, history, history.last, value);
  const bool confirmed = Agree(point, history, history.candidate, value);
  if (confirmed || (near && point.recheck == config::Recheck::jump)) {
    history.last = value;
    history.candidate = {};
    history.readings = 0;
    history.largest = std::max(history.largest, Abs(Decimal::Of(value).value_or(0)));
    return Finding::counts;
  }
  history.candidate = value;
  history.readings = std::min(history.readings + 1, kMostReadings);
  if (history.readings == kMostReadings) return Finding::last_resort;
  return near ? Finding::wait : Finding::doubt;
}

JumpCheck::Result JumpCheck::Check(std::vector<Sample>& samples) {
  Result result;
  // It says itself that what it measures changes.
  const bool changes = std::ranges::any_of(
      samples, [](const Sample& sample) { return IsUncertain(sample.quality); });
  if (histories_.empty()) histories_.resize(points_.size());
  std::erase_if(samples, [&](Sample& sample) {
    const config::Point& point = points_[sample.point];
    if (point.recheck == config::Recheck::off || !IsGood(sample.quality)) return false;
    History& history = histories_[sample.point];
    const bool steady = !std::exchange(history.changes, changes) && !changes;
    const bool jumped = steady && HasValue(history.candidate) && HasValue(history.last);
    // A value that has moved on really changes.
    const bool returned = jumped && Agree(point, history, history.last, sample.value) &&
                          !Agree(point, history, history.candidate, sample.value);
    result.unconfirmed = result.unconfirmed || returned;
    switch (Judge(point, history, sample.value)) {
      case Finding::counts:
        return false;
      case Finding::last_resort:
        sample.quality = Quality::uncertain;
        if (IsSeldom(point.group)) result.spoils = point.group;
        return false;
      case Finding::doubt:
        result.doubtful.push_back(sample.point);
        break;
      case Finding::wait:
        break;
    }
    result.ask_again = true;
    return true;
  });
  return result;
}

void JumpCheck::OnWritten(std::size_t point, Value value) {
  if (points_[point].recheck == config::Recheck::off) return;
  if (histories_.empty()) histories_.resize(points_.size());
  histories_[point].candidate = std::move(value);
  histories_[point].readings = 0;
}

}  // namespace baudgate
