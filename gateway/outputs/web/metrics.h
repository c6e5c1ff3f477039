// What Prometheus reads at /metrics: the store as text, in its format 0.0.4. Nothing is asked of a
// line for it.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <string>

#include "config/model/config.h"
#include "gateway/bus/points/point_store.h"
#include "gateway/outputs/status/status_json.h"

namespace baudgate::web {

// The metrics: their names, which are a public contract (docs/metrics.md), and how many series a
// gateway has.
enum class Family : std::size_t {
  build_info,
  line_up,
  line_busy,
  round_trip,
  device_state,
  device_last_ok,
  exchanges,
  point_value,
  point_quality,
  point_age,
  log_dropped,
  alarms,
  cpu,
  memory,
  started,
};

inline constexpr std::array<Metric, 15> kMetrics = {{
    {"baudgate_build_info", "gauge", "version", "The version of the gateway; always 1."},
    {"baudgate_line_up", "gauge", "line", "1 while the port of the line is open, else 0."},
    {"baudgate_line_busy_seconds_total", "counter", "line,why",
     "Time in exchanges and in the silences after them, by what for."},
    {"baudgate_exchange_duration_seconds", "histogram", "line",
     "Round trips of exchanges with a good reply."},
    {"baudgate_device_state", "gauge", "line,device,state",
     "1 for the state that the device is in, 0 for the others."},
    {"baudgate_device_last_ok_timestamp_seconds", "gauge", "line,device",
     "When the device last answered; absent: never."},
    {"baudgate_exchanges_total", "counter", "line,device,outcome",
     "Exchanges with the device, by how they ended."},
    {"baudgate_point_value", "gauge", "line,device,point,unit",
     "The value; absent while it is not good, and of texts."},
    {"baudgate_point_quality", "gauge", "line,device,point",
     "Quality and reason as one number, 192 is good."},
    {"baudgate_point_age_seconds", "gauge", "line,device,point",
     "Time since the last reading; absent before the first."},
    {"baudgate_log_dropped_total", "counter", "",
     "Lines of the log that nobody took: neither the journal nor standard error."},
    {"baudgate_alarms", "gauge", "state", "Alarms that are active, and that wait for somebody."},
    {"process_cpu_seconds_total", "counter", "", "Processor time of the gateway."},
    {"process_resident_memory_bytes", "gauge", "", "Memory of the gateway."},
    {"process_start_time_seconds", "gauge", "", "When the gateway began to poll."},
}};
constexpr const Metric& Of(Family family) { return kMetrics[static_cast<std::size_t>(family)]; }

/// At most, while all is good, without those of Modbus requests: each listener has one for every
/// function and exception that it has answered.
std::size_t SeriesOf(const config::Config& config);

std::string MetricsText(const config::Config& config, const PointStore& store,
                        const control::GatewayInfo& info, Now now);

}  // namespace baudgate::web
