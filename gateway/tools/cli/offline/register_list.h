// Reads the register list of a device: a spreadsheet with one row for each value. Its rows become
// the points of a profile (new_profile.h).
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "gateway/base/decimal.h"

namespace baudgate::tools {

/// The number that the list gives the first holding register. Manuals differ, and the list itself
/// does not tell.
enum class FirstRegister : std::uint8_t {
  zero,     ///< 0, as on the wire
  one,      ///< 1
  modicon,  ///< 40001; then 30001 is the first input register, 10001 a discrete input, 1 a coil
};

struct ListedPoint {
  int line = 0;
  std::string name;
  std::string table;  ///< coil, discrete, holding or input
  std::uint16_t address = 0;
  std::string form;  ///< type of the registers, such as "uint16"; for bits "bool"
  std::string type;
  std::string order;  ///< byte order in the device: "CDAB"; empty: the profile's default
  Decimal scale = 1;
  std::string unit;
  std::string access = "r";
  std::string group;
  std::string description;  ///< name in the list, if it cannot be the name of a point
  /// The example as a YAML value for the twin; empty: the list contains no example.
  std::optional<std::string> simulate;
  std::size_t registers = 1;
};

struct RegisterList {
  std::vector<ListedPoint> points;
  std::vector<std::string> errors;    ///< "list.csv:3: …"; with an error, no profile is made
  std::vector<std::string> warnings;  ///< "list.csv:3: …"
  /// If `first` is needed but was not given: the range of the register numbers in the list,
  /// "40001…40051".
  std::string numbers;
};

/// Reads the list. `file`: its name in messages. `table`: "holding" or "input", for numbers that do
/// not show their table.
RegisterList ReadRegisterList(const std::string& text, const std::string& file,
                              const std::string& table, std::optional<FirstRegister> first);

}  // namespace baudgate::tools
