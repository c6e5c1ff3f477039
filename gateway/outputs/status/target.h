// Which line or device a user means by "bay-1" or "bay-1.feeder-1".
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
  std::uint32_t line = 0;                 ///< as in the configuration
  std::optional<std::uint32_t> device{};  ///< as in the point store; nothing: the whole line
};

/// The error names what there is, and what was probably meant.
Result<Target> FindTarget(const config::Config& config, std::string_view text);

/// The device of that name on that line.
Result<Target> FindDevice(const config::Config& config, std::uint32_t line, std::string_view name);

/// Points of one device.
struct PointsTarget {
  std::uint32_t device = 0;             ///< as in the point store
  std::vector<std::uint32_t> points{};  ///< indices in the device's points
};

/// LINE.DEVICE.POINT, one point; or LINE.DEVICE, all that can be read.
Result<PointsTarget> FindPoints(const config::Config& config, std::string_view text);

/// LINE.DEVICE.POINT.
struct PointTarget {
  std::uint32_t device = 0;
  std::uint32_t point = 0;
};
Result<PointTarget> FindPoint(const config::Config& config, std::string_view text);

/// LINE.DEVICE.POINT of all that a pattern of that form means, each part with * and ?.
std::vector<std::string> PointsLike(const config::Config& config, std::string_view pattern);

/// The error names what there is. `line` empty: any.
Status KnowsDevice(const config::Config& config, const std::string& line,
                   const std::string& device);

}  // namespace baudgate::status
