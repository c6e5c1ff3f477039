// What only a whole line shows, or the whole list of routes: times that can not work together, more
// polls than the bit rate has room for, units that never reach a route. Fed by config/loader with
// what has no errors; results are warnings.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <vector>

#include "config/catalog.h"
#include "config/model/config.h"
#include "config/names.h"
#include "config/yaml/problem.h"

namespace baudgate::config {

void CheckLine(const Line& line, const Catalog& catalog, Problems& problems);

/// Unit ids of all devices.
UnitSet DeviceUnits(const Config& config);
/// What each route of config.modbus really gets: without what devices and earlier routes take.
std::vector<UnitSet> RouteUnits(const Config& config);

void CheckRoutes(const Config& config, const Catalog& catalog, Problems& problems);

}  // namespace baudgate::config
