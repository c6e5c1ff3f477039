// `baudgate map`: where every point of a configuration is found on Modbus and DDS, for the people
// who program the PLC. The file comes through config/loader; tables go to the streams of the
// caller. PlaceOf finds a point on Modbus, and PrintStructuredText writes a PLC program.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <ostream>
#include <string>

#include "config/catalog/catalog.h"
#include "config/model/config.h"

namespace baudgate::tools {

// Where a point of a configuration is found on Modbus, for the forms of `baudgate map`.

/// Everything the contract says about the place of one point.
struct MapPlace {
  bool served = false;
  bool bit = false;
  int address = 0;
  int registers = 0;
  std::string tables;        ///< "input, holding"
  std::string read_codes;    ///< "4,3"
  std::string write_codes;   ///< "6,16"; empty = read-only
  std::string conventional;  ///< "30001/40001"
};

MapPlace PlaceOf(const config::Device& device, const config::Point& point);

enum class MapFormat : std::uint8_t { table, csv, json, structured_text, markdown };

/// Exit codes: 0 done, 3 the configuration is bad (its problems go to `err`).
int RunMap(const std::string& file, const config::Catalog& catalog, MapFormat format,
           std::ostream& out, std::ostream& err);

// `baudgate map --format st`: the points as global variables of a PLC program.

/// Structured Text of IEC 61131-3. The registers and bits of the units lie one behind the other in
/// the PLC's inputs; what may be written lies in its outputs alike. Comments say which registers
/// the PLC has to copy where.
void PrintStructuredText(const config::Config& config, std::ostream& out);

}  // namespace baudgate::tools
