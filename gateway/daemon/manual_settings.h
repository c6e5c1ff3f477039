// What a person has set at a running line by `release`, `disable` or `enable`: a reload that
// restarts the line carries it over. If a loan ended with the old line, there would be two masters
// on the bus. But a network client loses its connection with the old line, and polls go on.
//
//   bay-1 is lent until 12:00, its device a disabled; a reload changes the poll of a
//   bay-1 is restarted: lent until 12:00, a disabled
//
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <map>
#include <string>

#include "config/model/line.h"
#include "gateway/bus/points/point_store.h"
#include "gateway/lines/line_control.h"

namespace baudgate {

struct ManualSettings {
  WallTime released_until{};             ///< the epoch: the port is not lent by hand
  std::map<std::string, bool> in_use{};  ///< devices that differ from `enabled`
};

/// The manual settings of a running line, by its number.
ManualSettings ManualSettingsOf(const PointStore& store, std::uint32_t line,
                                const config::Line& config);

/// Applies them to the line in its place, by its number, which is not started yet. If the new
/// configuration has changed `enabled` of a device, that holds.
void Restore(const ManualSettings& before, LineControl& lines, const config::Line& config,
             std::uint32_t line, std::uint32_t first_device, WallTime now);

}  // namespace baudgate
