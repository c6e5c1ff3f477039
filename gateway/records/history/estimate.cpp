// SPDX-License-Identifier: Apache-2.0
#include "gateway/records/history/estimate.h"

#include <algorithm>

#include "gateway/records/history/trend_file.h"

namespace baudgate::history {
namespace {

constexpr std::uint64_t kEntry = 3;       // of many in a chunk
constexpr std::uint64_t kFewEntries = 8;  // of few
constexpr std::uint64_t kChunk = 60;      // each, and its index; one an hour
constexpr std::uint64_t kSpan = 70;
constexpr std::uint64_t kHoursADay = 24;

Duration PeriodOf(const config::Device& device, const config::Point& point) {
  const Duration period = config::PeriodOf(device, point.group);
  return period == Duration::zero() ? 24h : period;
}

void Add(const config::Device& device, const config::HistoryPoint& its, Estimate& estimate) {
  constexpr Duration kOneDay = 24h;
  const config::Point& point = device.points[its.point];
  const Duration period = std::max<Duration>(PeriodOf(device, point), 1ms);
  const auto readings = static_cast<std::uint64_t>(kOneDay / period);
  const auto repeats = static_cast<std::uint64_t>(kOneDay / std::max(its.max_gap, period));
  const std::uint64_t chunks = kChunk * std::min(kHoursADay, readings);
  const std::uint64_t hours = kSpan * kHoursADay;
  const std::uint64_t most = readings * (readings > 1000 ? kEntry : kFewEntries) + chunks + hours;
  estimate.most += most;
  estimate.least += its.every ? most : std::min(most, repeats * kFewEntries + chunks + hours);
  if (point.type == config::Type::string) return;
  estimate.minutes += kSpan * static_cast<std::uint64_t>(kKeepMinutes / kMinute);
}

}  // namespace

std::uint64_t Estimate::Days(std::uint64_t limit, std::uint64_t bytes_a_day) const {
  if (limit <= minutes || bytes_a_day == 0) return 0;
  return (limit - minutes) / bytes_a_day;
}

Estimate EstimateOf(const config::Config& config) {
  Estimate estimate;
  for (std::size_t line = 0; line < config.lines.size(); ++line) {
    const std::uint32_t first = config::FirstDevice(config, line);
    const auto& devices = config.lines[line].devices;
    for (const config::HistoryPoint& point : config.history.points) {
      if (point.device < first || point.device >= first + devices.size()) continue;
      Add(devices[point.device - first], point, estimate);
    }
  }
  return estimate;
}

}  // namespace baudgate::history
