// SPDX-License-Identifier: Apache-2.0
#include "gateway/history/swing_door.h"

#include <algorithm>
#include <cmath>
#include <utility>

namespace baudgate::history {
namespace {

bool IsNumber(const Entry& entry) {
  const Value& value = entry.value;
  return HasValue(value) && !std::holds_alternative<std::string>(value) &&
         !std::holds_alternative<bool>(value) && std::isfinite(ToDouble(value));
}

double Between(const Entry& from, const Entry& to, double off) {
  return (ToDouble(to.value) + off - ToDouble(from.value)) /
         static_cast<double>(to.time - from.time);
}

}  // namespace

std::vector<Entry> SwingDoor::Take(const Entry& now) {
  std::vector<Entry> kept;
  const bool line = begin_ && IsNumber(*begin_) && IsNumber(now) && now.quality == begin_->quality;
  // An hour that is over waits for nothing.
  const bool same_hour = !latest_ || FloorTo(now.time, kHour) == FloorTo(latest_->time, kHour);
  const bool fits = line && same_hour && Fits(now);
  if (!fits && latest_) {
    kept.push_back(*latest_);
    Begin(*std::exchange(latest_, std::nullopt));
    if (line) {
      Narrow(now);
      latest_ = now;
    }
  } else if (fits) {
    Narrow(now);
    latest_ = now;
  }
  const bool same = begin_ && now.quality == begin_->quality && now.value == begin_->value;
  const bool waits = latest_ || (same && !line);
  if (waits && now.time - begin_->time < max_gap_) return kept;
  kept.push_back(now);
  latest_.reset();
  Begin(now);
  return kept;
}

std::optional<Entry> SwingDoor::End() {
  auto last = std::exchange(latest_, std::nullopt);
  begin_.reset();
  return last;
}

void SwingDoor::Forget() {
  begin_.reset();
  latest_.reset();
}

void SwingDoor::Begin(const Entry& at) {
  begin_ = at;
  low_ = -std::numeric_limits<double>::infinity();
  high_ = std::numeric_limits<double>::infinity();
}

bool SwingDoor::Fits(const Entry& now) const {
  const double slope = Between(*begin_, now, 0);
  return low_ <= slope && slope <= high_;
}

void SwingDoor::Narrow(const Entry& now) {
  low_ = std::max(low_, Between(*begin_, now, -deadband_));
  high_ = std::min(high_, Between(*begin_, now, deadband_));
}

}  // namespace baudgate::history
