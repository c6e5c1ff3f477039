// SPDX-License-Identifier: Apache-2.0
#include "gateway/tools/simulate/simulated_values.h"

#include <cmath>
#include <numbers>
#include <string>

namespace baudgate {
namespace {

constexpr double kWaveSeconds = 60;

}  // namespace

SimulatedValues::SimulatedValues(const std::vector<config::Point>& points, std::uint32_t seed)
    : points_(points), seed_(seed), written_(points.size()) {}

Value SimulatedValues::Get(std::size_t index, Instant now) const {
  if (HasValue(written_[index])) return written_[index];
  const config::Point& point = points_[index];
  const config::Simulate& simulate = *point.simulate;
  if (point.type == config::Type::string) return simulate.text.value_or(std::string());
  const double seconds = std::chrono::duration<double>(now.time_since_epoch()).count();
  const double phase = 0.7 * static_cast<double>(index) + 2.1 * static_cast<double>(seed_);
  const double wave = std::sin(2 * std::numbers::pi * seconds / kWaveSeconds + phase);
  const double value = simulate.low + (simulate.high - simulate.low) * (0.5 + 0.5 * wave);
  switch (point.type) {
    case config::Type::boolean:
      return value >= 0.5;
    case config::Type::float32:
    case config::Type::float64:
      return value;
    default:
      return static_cast<std::int64_t>(std::llround(value));
  }
}

void SimulatedValues::Set(std::size_t point, const Value& value) { written_[point] = value; }

}  // namespace baudgate
