// Which requests read a device's points: neighbours of one table share one, with the registers
// between them, as far as the device lets them. Points come from the configuration.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <span>
#include <vector>

#include "config/model/point.h"
#include "protocols/modbus/settings.h"
#include "protocols/modbus/space.h"

namespace baudgate::protocols::modbus {

using SpacePlan = QueryPlan<Space>;

/// Where each point is read; nothing where it is not.
std::vector<std::optional<Place>> ReadPlaces(std::span<const config::Point> points);

/// `places`: those of `points`. What a device refuses and has never answered is asked with the slow
/// group.
SpacePlan MakePlan(std::span<const config::Point> points,
                   std::span<const std::optional<Place>> places, const Settings& settings,
                   Often is_often = IsFast);

/// Reads of as many registers, or bytes of bits, as no query of the same table asks for, each from
/// where a query begins. First those that ask for nothing beyond their query: a device may refuse
/// the others. Empty: there is no query of a table.
std::vector<Block<Space>> DistinctReads(const SpacePlan& plan);

}  // namespace baudgate::protocols::modbus
