// SPDX-License-Identifier: Apache-2.0
#include "gateway/outputs/web/series.h"

#include "gateway/outputs/web/metrics.h"

namespace baudgate::web {

std::size_t SeriesOf(const config::Config& config) {
  // version, clients, log, two of alarms, three of the process
  std::size_t series = 8;
  if (config.dds.enabled) ++series;
  for (const config::Line& line : config.lines) {
    if (line.name.empty()) continue;
    series += 1 + kLineUses + kDurationBuckets + 2;  // up, busy; buckets, sum and count
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
