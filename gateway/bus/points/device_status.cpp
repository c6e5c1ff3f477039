// SPDX-License-Identifier: Apache-2.0
#include "gateway/bus/points/device_status.h"

#include <algorithm>
#include <cmath>

namespace baudgate {
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

}  // namespace baudgate
