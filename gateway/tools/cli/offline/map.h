// `baudgate map`: where every point of a configuration is found on Modbus and DDS, for the people
// who program the PLC. The file comes through config/loader; tables go to the streams of the
// caller.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <ostream>
#include <string>

#include "config/catalog/catalog.h"

namespace baudgate {

enum class MapFormat : std::uint8_t { table, csv, json, structured_text, markdown };

/// Exit codes: 0 done, 3 the configuration is bad (its problems go to `err`).
int RunMap(const std::string& file, const config::Catalog& catalog, MapFormat format,
           std::ostream& out, std::ostream& err);

}  // namespace baudgate
