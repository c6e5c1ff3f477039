// `LoadFile` turns a YAML file into a config::Config and reports all problems at once, each with
// its position in a file.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "config/catalog/catalog.h"
#include "config/model/config.h"
#include "config/model/problem.h"

namespace baudgate::config {

struct Loaded {
  Config config;  ///< valid only if ok()
  std::vector<Problem> problems;

  bool ok() const { return !HasError(problems); }
};

struct LoadedProfile {
  Profile profile;  ///< valid only if ok()
  std::vector<Problem> problems;

  bool ok() const { return !HasError(problems); }
};

/// Loads a file; never throws. Relative profile paths are relative to the file.
Loaded LoadFile(const std::string& path, const Catalog& catalog);
/// Loads a text; `name` is the file's name in messages.
Loaded LoadText(const std::string& text, const std::string& name, const Catalog& catalog);
/// Loads a profile: a name in the catalog, or a path (with a '/' or ending in .yaml).
LoadedProfile LoadProfile(const std::string& profile, const protocols::Protocol& protocol,
                          const Catalog& catalog);
/// Like LoadProfile, for a text. `file` is the file's name in messages; `name` is the name by which
/// devices use the profile.
LoadedProfile LoadProfileText(const std::string& text, const std::string& file,
                              const std::string& name, const protocols::Protocol& protocol,
                              const Catalog& catalog);

/// Returns the device that a configuration with this profile and no other keys would give; for
/// commands without a configuration (decode, simulate, demo). Every option is present.
Device DeviceFromProfile(const Profile& profile, const protocols::Protocol& protocol,
                         std::string name, std::string address);

}  // namespace baudgate::config
