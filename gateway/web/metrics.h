// What Prometheus reads at /metrics: the store as text, in its format 0.0.4. Nothing is asked of a
// line for it.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "gateway/status/status_json.h"
#include "gateway/store/point_store.h"

namespace baudgate::web {

/// Bounds of the histogram: every octave of round trips.
inline constexpr std::size_t kDurationBuckets = RoundTrips::kBuckets / 4;
inline constexpr std::size_t kDeviceStates = 5;

std::string MetricsText(const config::Config& config, const PointStore& store,
                        const control::GatewayInfo& info, Now now);

}  // namespace baudgate::web
