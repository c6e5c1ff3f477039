// `FindTarget` and others find the line, device or points that a user names, e.g. "bay-1" or
// "bay-1.feeder-1".
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

/// LINE or LINE.DEVICE. The error lists the existing names and a similar one.
Result<Target> FindTarget(const config::Config& config, std::string_view text);

Result<Target> FindDevice(const config::Config& config, std::uint32_t line, std::string_view name);

struct PointsTarget {
  std::uint32_t device = 0;             ///< index in the point store
  std::vector<std::uint32_t> points{};  ///< indices in the device's points
};

/// LINE.DEVICE.POINT, one point; or LINE.DEVICE, all points that can be read.
Result<PointsTarget> FindPoints(const config::Config& config, std::string_view text);

/// Indices in the point store and in the device's points.
struct PointTarget {
  std::uint32_t device = 0;
  std::uint32_t point = 0;
};
Result<PointTarget> FindPoint(const config::Config& config, std::string_view text);

/// LINE.DEVICE.POINT of all points that match a pattern of this form, each part with * and ?.
std::vector<std::string> PointsLike(const config::Config& config, std::string_view pattern);

/// An error lists the existing devices. `line` empty: on any line.
Status KnowsDevice(const config::Config& config, const std::string& line,
                   const std::string& device);

}  // namespace baudgate::status
