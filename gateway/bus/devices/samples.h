// Readings of a device as the store takes them.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "config/model/device.h"
#include "gateway/bus/points/conversion.h"
#include "gateway/bus/points/point_store.h"
#include "protocols/conversation.h"

namespace baudgate {

/// Only of its points: other readings are left out.
inline std::vector<Sample> SamplesOf(const config::Device& device,
                                     std::span<const Reading> readings) {
  std::vector<Sample> samples;
  samples.reserve(readings.size());
  for (const Reading& reading : readings) {
    if (reading.point >= device.points.size()) continue;
    samples.push_back(ToSample(device.points[reading.point], reading));
  }
  return samples;
}

inline std::vector<std::uint32_t> PointsOf(std::span<const Sample> samples) {
  std::vector<std::uint32_t> points;
  points.reserve(samples.size());
  for (const Sample& sample : samples) points.push_back(sample.point);
  return points;
}

}  // namespace baudgate
