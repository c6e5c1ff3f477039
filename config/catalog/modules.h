// `LoadModules` finds and loads protocol modules and finds the folders of profiles. Search order of
// modules: $BAUDGATE_MODULES, beside the binary, the install path. The order for profiles is the
// same, with /etc/baudgate/profiles before the shipped ones.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "config/catalog/catalog.h"

namespace baudgate::config {

struct Modules {
  Catalog catalog;
  /// One sentence with the path for each module that was refused: another contract, another
  /// compiler, no module.
  std::vector<std::string> refused;
};

/// Loads each module once and never unloads one.
Modules LoadModules();

/// Returns the folders of profiles; an earlier one takes precedence. The last two of `roots` must
/// be those of the shipped profiles.
std::vector<std::filesystem::path> ProfileFolders(const std::vector<std::filesystem::path>& roots);

}  // namespace baudgate::config
