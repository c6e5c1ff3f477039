// SPDX-License-Identifier: Apache-2.0
#include "gateway/bus/points/device_status.h"

#include <algorithm>
#include <cmath>

namespace baudgate::bus {

namespace {

std::int64_t NumberOf(Instant now) { return now.time_since_epoch() / 1min; }

}  // namespace

MinuteCounts& MinuteCounts::operator+=(const MinuteCounts& other) {
  VisitFields(this, [&](auto row) { this->*row.member += other.*row.member; });
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

namespace {

constexpr double kFirstEdgeUs = 64;
constexpr double kBucketsPerOctave = 4;

}  // namespace

std::size_t RoundTrips::BucketOf(Duration round_trip) {
  const double us = static_cast<double>(round_trip.count()) / 1e3;
  if (us <= kFirstEdgeUs) return 0;
  const double bucket = std::ceil(std::log2(us / kFirstEdgeUs) * kBucketsPerOctave);
  return std::min(static_cast<std::size_t>(bucket), kBuckets - 1);
}

Duration RoundTrips::UpperEdge(std::size_t bucket) {
  const double us = kFirstEdgeUs * std::exp2(static_cast<double>(bucket) / kBucketsPerOctave);
  return Duration(std::llround(us * 1e3));
}

void RoundTrips::Add(Duration round_trip) {
  ++buckets_[BucketOf(round_trip)];
  ++count_;
  sum_ += round_trip;
  last_ = round_trip;
}

Duration RoundTrips::mean() const {
  return count_ == 0 ? Duration::zero() : sum_ / static_cast<std::int64_t>(count_);
}

Duration RoundTrips::Percentile(double share) const {
  if (count_ == 0) return Duration::zero();
  const double wanted = share * static_cast<double>(count_);
  double seen = 0;
  for (std::size_t bucket = 0; bucket < kBuckets; ++bucket) {
    seen += static_cast<double>(buckets_[bucket]);
    if (seen >= wanted) return UpperEdge(bucket);
  }
  return UpperEdge(kBuckets - 1);
}

}  // namespace baudgate::bus
