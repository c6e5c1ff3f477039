// Finds and loads protocol modules, and says where profiles are.
// Search order: $BAUDGATE_MODULES, beside the binary, the install path; for profiles the same, with
// /etc/baudgate/profiles before the shipped ones.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "config/catalog/catalog.h"

namespace baudgate::config {

struct Modules {
  Catalog catalog;
  /// Modules that were found and refused, each a sentence with its path: another interface version,
  /// another compiler, not a module at all.
  std::vector<std::string> refused;
};

/// Loads every module once; none is ever unloaded.
Modules LoadModules();

/// Where profiles are looked for, the first hit wins. `roots` ends with the two places of what is
/// shipped.
std::vector<std::filesystem::path> ProfileFolders(const std::vector<std::filesystem::path>& roots);

}  // namespace baudgate::config
