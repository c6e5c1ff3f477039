// Which requests read a device's points: neighbours of one table share one, with the registers
// between them, as far as the device lets them. Points come from the configuration.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <optional>
#include <span>
#include <vector>

#include "config/model/point.h"
#include "protocols/common/query_plan.h"
#include "protocols/modbus/points.h"
#include "protocols/modbus/settings.h"

namespace baudgate::protocols::modbus {

/// Places are registers or bits of a table.
using TablePlan = QueryPlan<Table>;

inline Block<Table> BlockOf(const Place& place) {
  return {place.table, place.address, place.end(), 1};
}

/// Where each point is read; nothing where it is not.
std::vector<std::optional<Place>> ReadPlaces(std::span<const config::Point> points);

/// `places`: those of `points`. What a device refuses is asked with the slow group; splits stay,
/// because a device that comes and goes would have to refuse everything anew.
TablePlan MakePlan(std::span<const config::Point> points,
                   std::span<const std::optional<Place>> places, const Settings& settings);

/// Reads as many registers, or bytes of bits, as no query does: the shortest such read from where
/// the first query begins. There is a query.
Block<Table> DistinctRead(const TablePlan& plan);

/// The PDU that reads the block: 03 00 C8 00 02.
Bytes ReadOf(const Block<Table>& block);

}  // namespace baudgate::protocols::modbus
