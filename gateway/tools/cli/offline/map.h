// `baudgate map`: prints the addresses of each point on Modbus and DDS, for PLC programmers.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <ostream>
#include <string>

#include "config/catalog/catalog.h"
#include "config/model/config.h"

namespace baudgate::tools {

struct MapPlace {
  bool served = false;
  bool bit = false;
  int address = 0;
  int registers = 0;
  std::string tables;        ///< Modbus tables: "input, holding"
  std::string read_codes;    ///< function codes for reading: "4,3"
  std::string write_codes;   ///< function codes for writing: "6,16"; empty: read-only
  std::string conventional;  ///< register numbers as in PLC manuals: "30001/40001"
};

MapPlace PlaceOf(const config::Device& device, const config::Point& point);

enum class MapFormat : std::uint8_t { table, csv, json, structured_text, markdown };

/// Exit codes: 0 done; 3 the configuration has errors, which are printed on `err`.
int RunMap(const std::string& file, const config::Catalog& catalog, MapFormat format,
           std::ostream& out, std::ostream& err);

/// `baudgate map --format st`: prints the points as global variables in Structured Text (IEC
/// 61131-3). The registers and bits of all devices are placed one after the other in the PLC's
/// inputs, and the writable points in its outputs. Comments in the text tell which registers the
/// PLC must copy, and to which address.
void PrintStructuredText(const config::Config& config, std::ostream& out);

}  // namespace baudgate::tools
