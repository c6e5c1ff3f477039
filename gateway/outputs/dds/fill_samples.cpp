// SPDX-License-Identifier: Apache-2.0
#include "gateway/outputs/dds/fill_samples.h"

#include <algorithm>

namespace baudgate::dds {
namespace {

std::uint32_t Microseconds(Duration duration) {
  return static_cast<std::uint32_t>(std::clamp<std::int64_t>(duration / 1us, 0, UINT32_MAX));
}

}  // namespace

void FillPoint(const DeviceRecord& record, std::uint32_t point, const PointState& state,
               PointSample& sample) {
  const PointRecord& held = record.points[point];
  const config::Point& described = record.device->points[point];
  sample.device = record.device->name;
  sample.point = described.name;
  sample.value = state.number;
  AssignBounded(sample.text, TextOf(held.value), kMaxText);
  AssignBounded(sample.unit, described.unit, kMaxUnit);
  sample.quality = state.quality.word();
  sample.source_time_ns = held.read_at ? held.source_time.time_since_epoch().count() : 0;
  sample.seq = held.seq;
  sample.rtt_us = held.rtt_us;
}

void FillDevice(const DeviceRecord& record, DeviceSample& sample) {
  const DeviceStatus& status = record.status;
  sample.device = record.device->name;
  sample.line = record.line->name;
  sample.state = static_cast<std::uint16_t>(status.state);
  sample.last_outcome = static_cast<std::uint16_t>(status.last_outcome);
  sample.last_ok_time_ns = status.last_ok ? status.last_ok_wall.time_since_epoch().count() : 0;
  sample.exchanges = status.exchanges;
  sample.ok = status.Count(Outcome::ok);
  sample.no_reply = status.Count(Outcome::no_reply);
  sample.corrupt = status.Count(Outcome::corrupt);
  sample.retries = status.retries;
  const bool measured = status.round_trips.count() > 0;
  sample.rtt_mean_us = measured ? Microseconds(status.round_trips.mean()) : 0;
  sample.rtt_p99_us = measured ? Microseconds(status.round_trips.Percentile(0.99)) : 0;
}

}  // namespace baudgate::dds
