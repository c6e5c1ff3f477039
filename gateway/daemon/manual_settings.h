// What somebody has set at a line while it ran, by `release`, `disable` or `enable`: a reload that
// begins the line anew carries it over. A loan that ended with it would put two masters on the bus,
// but a client over the network loses its connection with the line, and polls go on.
//
//   bay-1 is lent until 12:00, its device a disabled; a reload changes the poll of a
//   bay-1 begins anew: lent until 12:00, a disabled
//
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <map>
#include <string>

#include "config/model/line.h"
#include "gateway/requests/line_control.h"
#include "gateway/store/point_store.h"

namespace baudgate {

struct ManualSettings {
  WallTime released_until{};             ///< the epoch: the port is not lent by hand
  std::map<std::string, bool> in_use{};  ///< devices that are otherwise than `enabled` says
};

/// The manual settings of a running line, by its number.
ManualSettings ManualSettingsOf(const PointStore& store, std::uint32_t line,
                                const config::Line& config);

/// To the line in its place, by its number, which has not been started. What the new configuration
/// says of a device stands where it is another than before.
void Restore(const ManualSettings& before, LineControl& lines, const config::Line& config,
             std::uint32_t line, std::uint32_t first_device, WallTime now);

}  // namespace baudgate
