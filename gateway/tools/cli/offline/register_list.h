// Reads a device's register list: a spreadsheet with one row for each value. Its rows become the
// points of a profile (new_profile.h).
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "gateway/base/decimal.h"

namespace baudgate::tools {

/// The number of the first holding register in the list. Manuals differ, and no list contains it.
enum class FirstRegister : std::uint8_t {
  zero,     ///< 0, as on the wire
  one,      ///< 1
  modicon,  ///< 40001; then 30001 is the first input register, 10001 a discrete input, 1 a coil
};

struct ListedPoint {
  int line = 0;  ///< line number in the file
  std::string name;
  std::string table;  ///< coil, discrete, holding or input
  std::uint16_t address = 0;
  std::string form;   ///< type of the registers: "uint16"; for bits "bool"
  std::string type;   ///< type of the value
  std::string order;  ///< byte order in the device: "CDAB"; empty: the profile's default
  Decimal scale = 1;
  std::string unit;
  std::string access = "r";
  std::string group;                    ///< empty: not given
  std::string description;              ///< the name in the list, if it cannot be a point name
  std::optional<std::string> simulate;  ///< the example as a YAML value for the twin; empty: none
  std::size_t registers = 1;            ///< number of registers that the value takes in the gateway
};

struct RegisterList {
  std::vector<ListedPoint> points;
  std::vector<std::string> errors;    ///< "list.csv:3: …"; no profile is made if there are any
  std::vector<std::string> warnings;  ///< "list.csv:3: …"
  /// The range of the plain register numbers, "40001…40051", if `first` is needed but was not
  /// given.
  std::string numbers;
};

/// `file`: name in messages. `table`: "holding" or "input", for numbers that do not show it.
RegisterList ReadRegisterList(const std::string& text, const std::string& file,
                              const std::string& table, std::optional<FirstRegister> first);

}  // namespace baudgate::tools
