// Where a point of a configuration is found on Modbus, for the forms of `baudgate map`.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <string>

#include "config/model/config.h"

namespace baudgate {

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

void ForEachDevice(const config::Config& config,
                   const std::function<void(const config::Line&, const config::Device&)>& visit);

}  // namespace baudgate
