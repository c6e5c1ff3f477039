// What becomes of every Modbus unit id: the table of `baudgate check`. Rows come from the
// configuration; text goes to the caller's stream.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <ostream>
#include <string>
#include <vector>

#include "config/model/config.h"

namespace baudgate {

/// One row, in the order in which requests are matched.
struct UnitRow {
  std::string units;     ///< "33-35, 37-40"; "others"
  std::string target;    ///< "line drive, slaves 1-3, 5-8"
  std::string deadline;  ///< "2.5s"; empty where none applies
};

/// Devices by unit, routes as configured (only with the units that they really get), the gateway
/// itself, all others.
std::vector<UnitRow> UnitRows(const config::Config& config);

void PrintRouteTable(const config::Config& config, std::ostream& out);

}  // namespace baudgate
