// Sets of Modbus unit ids: as text, and which of them devices and routes have.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <bitset>
#include <cstdint>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "config/model/config.h"
#include "gateway/base/result.h"

namespace baudgate::config {

using UnitSet = std::bitset<256>;  ///< by Modbus unit id, or by address on a line

/// "20" or "33-40": the first and the last unit id, 0…255.
Result<std::pair<std::uint8_t, std::uint8_t>> ParseUnits(std::string_view text);
/// "33-35, 37-40".
std::string UnitsText(const UnitSet& units);

/// What the route names.
UnitSet UnitsOf(const Route& route);
/// Unit ids of all devices.
UnitSet DeviceUnits(const Config& config);
/// What each route of config.modbus really gets: without what devices and earlier routes take.
std::vector<UnitSet> RouteUnits(const Config& config);

}  // namespace baudgate::config
