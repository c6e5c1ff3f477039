// SPDX-License-Identifier: Apache-2.0
#include "gateway/web/series.h"

#include "gateway/web/metrics.h"

namespace baudgate::web {

std::size_t SeriesOf(const config::Config& config) {
  // version, clients, two of alarms, three of the process
  std::size_t series = 7;
  for (const config::Line& line : config.lines) {
    if (line.name.empty()) continue;
    series += 2 + kDurationBuckets + 2;  // up and busy; buckets, sum and count
    for (const config::Device& device : line.devices) {
      series += kDeviceStates + kOutcomeCount - 1 + 1;
      for (const config::Point& point : device.points) {
        if (point.access == config::Access::write) continue;
        series += point.type == config::Type::string ? 2 : 3;
      }
    }
  }
  return series;
}

}  // namespace baudgate::web
