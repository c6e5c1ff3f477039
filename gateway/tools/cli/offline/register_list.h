// Reads the register list of a device: a spreadsheet with one row for each value. The rows become
// the points of a profile (gateway/tools/cli/offline/new_profile.h).
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "gateway/base/decimal.h"

namespace baudgate::tools {

/// The number by which the list calls the first holding register. Manuals differ, and a list does
/// not say which number it uses, so the user must.
enum class FirstRegister : std::uint8_t {
  zero,  ///< 0, as on the wire
  one,
  modicon,  ///< 40001; input registers then begin at 30001, discrete inputs at 10001, coils at 1
};

struct ListedPoint {
  int line = 0;
  std::string name;
  std::string table;  ///< coil, discrete, holding or input
  std::uint16_t address = 0;
  std::string form;  ///< type of the registers, such as "uint16"; "bool" for bits
  std::string type;
  std::string order;  ///< byte order in the device: "CDAB"; empty: the profile's default
  Decimal scale = 1;
  std::string unit;
  std::string access = "r";
  std::string group;
  std::string description;  ///< description, or the name in the list if it cannot be a point's name
  /// The list's example value, as YAML for a simulated device; empty: the list has none.
  std::optional<std::string> simulate;
  std::size_t registers = 1;
};

struct RegisterList {
  std::vector<ListedPoint> points;
  std::vector<std::string> errors;    ///< "list.csv:3: …"; with an error, no profile is made
  std::vector<std::string> warnings;  ///< "list.csv:3: …"
  /// The range of register numbers that only FirstRegister explains, "40001…40051"; empty: there
  /// are none.
  std::string numbers;
};

/// Reads the list. `file` is its name in messages. `table`, "holding" or "input", is the table of
/// registers for which the list tells no table.
RegisterList ReadRegisterList(const std::string& text, const std::string& file,
                              const std::string& table, std::optional<FirstRegister> first);

}  // namespace baudgate::tools
