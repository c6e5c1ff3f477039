// `LoadModules` finds and loads protocol modules and finds the folders of profiles. Modules are
// searched in $BAUDGATE_MODULES, beside the binary, and in the install path. The order for profiles
// is the same, with /etc/baudgate/profiles before the shipped profiles.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "config/catalog/catalog.h"

namespace baudgate::config {

struct Modules {
  Catalog catalog;
  /// One sentence with the path for each module that was refused, because it was built for another
  /// contract or compiler, or because it is not a module.
  std::vector<std::string> refused;
};

/// Loads each module once, from the first folder that contains it, and never unloads it.
Modules LoadModules();

/// Returns the folders of profiles; an earlier folder takes precedence. The last two of `roots`
/// must be the roots of the shipped profiles.
std::vector<std::filesystem::path> ProfileFolders(const std::vector<std::filesystem::path>& roots);

}  // namespace baudgate::config
