// `MetricsText` returns the text that Prometheus reads at /metrics: the point store in Prometheus'
// text format 0.0.4. It sends no request to a line.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <string>

#include "config/model/config.h"
#include "gateway/bus/points/point_store.h"
#include "gateway/outputs/status/status_json.h"

namespace baudgate::web {

/// Returns the number of time series when all points are good, which is the largest number. Series
/// of Modbus routes and requests are not included.
std::size_t SeriesOf(const config::Config& config);

std::string MetricsText(const config::Config& config, const bus::PointStore& store,
                        const status::GatewayInfo& info, Now now);

}  // namespace baudgate::web
