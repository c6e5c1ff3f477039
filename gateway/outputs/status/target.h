// `FindTarget` and the functions below find a line, device or points, e.g. "bay-1.feeder-1".
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

/// Finds LINE or LINE.DEVICE. The error lists the existing names and the most similar one.
Result<Target> FindTarget(const config::Config& config, std::string_view text);

Result<Target> FindDevice(const config::Config& config, std::uint32_t line, std::string_view name);

struct PointsTarget {
  std::uint32_t device = 0;             ///< index in the point store
  std::vector<std::uint32_t> points{};  ///< indices in the device's points
};

/// Finds LINE.DEVICE.POINT, one point, or LINE.DEVICE, all points of the device that can be read.
Result<PointsTarget> FindPoints(const config::Config& config, std::string_view text);

struct PointTarget {
  std::uint32_t device = 0;
  std::uint32_t point = 0;
};
Result<PointTarget> FindPoint(const config::Config& config, std::string_view text);

/// Each part of `pattern`, which has the form LINE.DEVICE.POINT, can contain * and ?.
std::vector<std::string> PointsLike(const config::Config& config, std::string_view pattern);

/// The error lists the existing devices. `line` empty: the device can be on any line.
Status KnowsDevice(const config::Config& config, const std::string& line,
                   const std::string& device);

}  // namespace baudgate::status
