// A device's register list as its manual has it, typed into a spreadsheet: one row a value. Rows
// become the points of a profile (new_profile.h). CheckPlaces finds points that take each other's
// registers.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "gateway/base/decimal.h"

namespace baudgate::tools {

/// What the list calls the first holding register. Manuals differ, and no list says it.
enum class FirstRegister : std::uint8_t {
  zero,     ///< 0, as on the wire
  one,      ///< 1
  modicon,  ///< 40001; then 30001 is the first input register, 10001 a discrete input, 1 a coil
};

struct ListedPoint {
  int line = 0;  ///< of the file
  std::string name;
  std::string table;  ///< coil, discrete, holding or input
  std::uint16_t address = 0;
  std::string form;   ///< what the registers hold: "uint16"; of bits "bool"
  std::string type;   ///< of the value
  std::string order;  ///< of the bytes in the device: "CDAB"; empty: as the profile says
  Decimal scale = 1;
  std::string unit;
  std::string access = "r";
  std::string group;        ///< empty: not given
  std::string description;  ///< the name as the list has it, where that is no point name
  std::optional<std::string> simulate;  ///< of the example: what the twin shows, as YAML has it
  std::size_t registers = 1;            ///< that the value takes in the gateway
};

struct RegisterList {
  std::vector<ListedPoint> points;
  std::vector<std::string> errors;    ///< "list.csv:3: …"; with one of them there is no profile
  std::vector<std::string> warnings;  ///< alike
  /// A plain register number stands in it, and `first` was not given: "40001…40051".
  std::string numbers;
};

/// `file` is its name in messages; `table`: of numbers that tell none, "holding" or "input".
RegisterList ReadRegisterList(const std::string& text, const std::string& file,
                              const std::string& table, std::optional<FirstRegister> first);

}  // namespace baudgate::tools
