// SPDX-License-Identifier: Apache-2.0
#include "gateway/bus/devices/device_health.h"

#include <algorithm>
#include <bit>
#include <utility>

namespace baudgate {

void DeviceHealth::OnExchange(Outcome outcome) {
  if (outcome == Outcome::line_down) return;  // says nothing about the device
  const bool refused = outcome == Outcome::refused || outcome == Outcome::unsupported;
  refusals_ = refused ? refusals_ + 1 : 0;
  failures_ = (failures_ << 1U) | (ProvesLife(outcome) ? 0U : 1U);
}

void DeviceHealth::OnTask(Outcome outcome, Instant now) {
  if (outcome == Outcome::line_down) return;
  if (ProvesLife(outcome)) {
    if (offline_) failures_ = 0;
    failed_tasks_ = 0;
    offline_ = false;
    seen_ = true;
    return;
  }
  if (failed_tasks_ == 0) failing_since_ = now;
  ++failed_tasks_;
  if (failed_tasks_ >= kOfflineCount && now - failing_since_ >= kOfflineTime) offline_ = true;
}

DeviceState DeviceHealth::state() const {
  if (offline_) return DeviceState::offline;
  if (!seen_) return DeviceState::never_seen;
  if (failed_tasks_ > 0 || std::popcount(failures_) >= kDegradedCount) return DeviceState::degraded;
  return DeviceState::online;
}

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

JumpCheck::Judgement JumpCheck::Judge(const config::Point& point, History& history,
                                      const Value& value) const {
  const bool near = Agree(point, history, history.last, value);
  const bool confirmed = Agree(point, history, history.candidate, value);
  if (confirmed || (near && point.recheck == config::Recheck::jump)) {
    history.last = value;
    history.candidate = {};
    history.readings = 0;
    history.largest = std::max(history.largest, Abs(Decimal::Of(value).value_or(0)));
    return Judgement::counts;
  }
  history.candidate = value;
  history.readings = std::min(history.readings + 1, kMostReadings);
  if (history.readings == kMostReadings) return Judgement::last_resort;
  return near ? Judgement::wait : Judgement::doubt;
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
      case Judgement::counts:
        return false;
      case Judgement::last_resort:
        sample.quality = Quality::uncertain;
        if (IsSeldom(point.group)) result.spoils = point.group;
        return false;
      case Judgement::doubt:
        result.doubtful.push_back(sample.point);
        break;
      case Judgement::wait:
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

namespace {

/// A line feed after the carriage return may be missing, or come with the next bytes.
View WithoutLineEnd(View frame) {
  while (!frame.empty() && (frame.back() == '\r' || frame.back() == '\n')) {
    frame = frame.first(frame.size() - 1);
  }
  return frame;
}

}  // namespace

bool Identity::Is(View reply) const {
  return known() && std::ranges::equal(WithoutLineEnd(reply), reply_);
}

void Identity::Learn(const Bytes& request, View reply, Outcome outcome) {
  const View frame = WithoutLineEnd(reply);
  request_ = request;
  reply_.assign(frame.begin(), frame.end());
  names_ = outcome == Outcome::ok;
  other_.clear();
  certain_ = false;
}

bool Identity::OnOther(View reply) {
  const View frame = WithoutLineEnd(reply);
  if (std::ranges::equal(frame, other_)) return true;
  other_.assign(frame.begin(), frame.end());
  return false;
}

}  // namespace baudgate
