// `FindTarget` and the functions below find the line, device or points that a user has named, e.g.
// "bay-1" or "bay-1.feeder-1".
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "config/model/config.h"
#include "gateway/base/result.h"

namespace baudgate::status {

struct Target {
  std::uint32_t line = 0;                 ///< index in the configuration
  std::optional<std::uint32_t> device{};  ///< index in the point store; empty: the whole line
};

/// Finds LINE or LINE.DEVICE. The error lists the existing names and suggests the most similar one.
Result<Target> FindTarget(const config::Config& config, std::string_view text);

Result<Target> FindDevice(const config::Config& config, std::uint32_t line, std::string_view name);

struct PointsTarget {
  std::uint32_t device = 0;             ///< index in the point store
  std::vector<std::uint32_t> points{};  ///< indices in the device's points
};

/// Finds one point (LINE.DEVICE.POINT), or all points of a device that can be read (LINE.DEVICE).
Result<PointsTarget> FindPoints(const config::Config& config, std::string_view text);

struct PointTarget {
  std::uint32_t device = 0;
  std::uint32_t point = 0;
};
Result<PointTarget> FindPoint(const config::Config& config, std::string_view text);
/// Returns the point LINE.DEVICE.POINT; null if the configuration has no such point.
const config::Point* PointNamed(const config::Config& config, std::string_view text);

/// Returns LINE.DEVICE.POINT for each point that matches `pattern`. The pattern has the same form;
/// each of its parts can contain * and ?.
std::vector<std::string> PointsLike(const config::Config& config, std::string_view pattern);

/// Returns an error that lists the existing devices if there is no such device. `line` empty: the
/// device can be on any line.
Status KnowsDevice(const config::Config& config, const std::string& line,
                   const std::string& device);

}  // namespace baudgate::status
