// What may be called how: the one rule for names of gateways, lines, devices and points, and for
// the unit ids of routes.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <bitset>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <utility>

#include "config/yaml/yaml_reader.h"
#include "gateway/base/result.h"

namespace baudgate::config {

/// Letters, digits and single '_' or '-' between them, at most 64 (the key length of the DDS
/// topics).
Status CheckName(std::string_view name);
/// Letters, digits and single '_' between them, no digit first: usable as an identifier everywhere.
Status CheckPointName(std::string_view name);

/// The `name` that a line or device must have, checked; messages call it so from now on.
std::optional<std::string> ReadName(MapReader& map, std::string_view example);

/// "20" or "33-40": the first and the last unit id, 0…255.
Result<std::pair<std::uint8_t, std::uint8_t>> ParseUnits(std::string_view text);

using UnitSet = std::bitset<256>;  ///< by Modbus unit id, or by address on a line

/// "33-35, 37-40".
std::string UnitsText(const UnitSet& units);

}  // namespace baudgate::config
