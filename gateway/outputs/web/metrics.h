// What Prometheus reads at /metrics: the store as text, in its format 0.0.4. Nothing is asked of a
// line for it.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "gateway/bus/points/point_store.h"
#include "gateway/outputs/status/status_json.h"

namespace baudgate::web {

/// Buckets of the histogram: an octave of round trips each, the last without a bound.
inline constexpr std::size_t kDurationBuckets = RoundTrips::kBuckets / 4;
inline constexpr std::size_t kDeviceStates = 5;

std::string MetricsText(const config::Config& config, const PointStore& store,
                        const control::GatewayInfo& info, Now now);

}  // namespace baudgate::web
