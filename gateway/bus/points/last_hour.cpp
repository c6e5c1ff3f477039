// SPDX-License-Identifier: Apache-2.0
#include "gateway/bus/points/last_hour.h"

namespace baudgate {
namespace {

std::int64_t NumberOf(Instant now) { return now.time_since_epoch() / 1min; }

}  // namespace

MinuteCounts& MinuteCounts::operator+=(const MinuteCounts& other) {
  answered += other.answered;
  failed += other.failed;
  repeats += other.repeats;
  missed += other.missed;
  outages += other.outages;
  up += other.up;
  down += other.down;
  served += other.served;
  wasted += other.wasted;
  return *this;
}

double Availability(const MinuteCounts& tally) {
  const Duration all = tally.up + tally.down;
  if (all <= Duration::zero()) return 1;
  return static_cast<double>(tally.up.count()) / static_cast<double>(all.count());
}

MinuteCounts& LastHour::At(Instant now) {
  const std::int64_t number = NumberOf(now);
  Minute& minute = minutes_[static_cast<std::size_t>(number) % kMinutes];
  if (minute.number != number) minute = {number, {}};
  return minute.tally;
}

MinuteCounts LastHour::Sum(Instant now, std::size_t full_minutes) const {
  const std::int64_t last = NumberOf(now);
  const std::int64_t first = last - static_cast<std::int64_t>(full_minutes);
  MinuteCounts sum;
  for (const Minute& minute : minutes_) {
    if (minute.number >= first && minute.number <= last) sum += minute.tally;
  }
  return sum;
}

std::array<MinuteCounts, LastHour::kMinutes> LastHour::All(Instant now) const {
  const std::int64_t first = NumberOf(now) - static_cast<std::int64_t>(kMinutes) + 1;
  std::array<MinuteCounts, kMinutes> all;
  for (const Minute& minute : minutes_) {
    const auto place = static_cast<std::size_t>(minute.number - first);
    if (minute.number >= first && place < kMinutes) all[place] = minute.tally;
  }
  return all;
}

}  // namespace baudgate
