// From a YAML file to config::Config: everything that is wrong is reported at once, with its place.
// Bytes come from a file or from memory; the result goes to the daemon and to the commands.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "config/catalog/catalog.h"
#include "config/model/config.h"
#include "config/model/problem.h"

namespace baudgate::config {

struct Loaded {
  Config config;  ///< to be used only when ok()
  std::vector<Problem> problems;

  bool ok() const { return !HasError(problems); }
};

struct LoadedProfile {
  Profile profile;  ///< to be used only when ok()
  std::vector<Problem> problems;

  bool ok() const { return !HasError(problems); }
};

/// Never throws. Relative profile paths are relative to the file.
Loaded LoadFile(const std::string& path, const Catalog& catalog);
/// `name` stands for the file in messages.
Loaded LoadText(const std::string& text, const std::string& name, const Catalog& catalog);
/// `profile`: a name in the catalog, or a path (with a '/' or ending in .yaml).
LoadedProfile LoadProfile(const std::string& profile, const protocols::Protocol& protocol,
                          const Catalog& catalog);
/// `file` stands for it in messages; `name`: what devices would call it by.
LoadedProfile LoadProfileText(const std::string& text, const std::string& file,
                              const std::string& name, const protocols::Protocol& protocol,
                              const Catalog& catalog);

/// The device that a configuration with nothing but this profile would give; for commands that know
/// no configuration (decode, simulate, demo). Every option is present.
Device DeviceFromProfile(const Profile& profile, const protocols::Protocol& protocol,
                         std::string name, std::string address);

}  // namespace baudgate::config
