// `ReadProfile` reads device profiles: config/profiles/<protocol>/<name>.yaml, found in the catalog
// or by path. ReadOptions reads the keys of a protocol, and ReadIdentity the key `identity`.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <map>
#include <string>
#include <vector>

#include "config/catalog/catalog.h"
#include "config/model/device.h"
#include "config/model/options.h"
#include "config/model/problem.h"
#include "config/points.h"
#include "config/yaml/yaml_reader.h"
#include "protocols/protocol.h"

namespace baudgate::config {

/// Reads the options of `scope` in `map`. Options of the other scope are errors, whose message says
/// where the option belongs.
Options ReadOptions(MapReader& map, const protocols::Protocol& protocol,
                    protocols::OptionSpec::Scope scope);

// The functions below read the names that devices report: the key `identity` of profiles and
// devices, and the names that the other installed profiles of a protocol list. Conversations
// (protocols/common/identification.h) compare these names with the name that the device reports.

/// Reads a device's `identity:`, a list or `ignore`; the default is the profile's names.
Identity ReadIdentity(MapReader& map, const std::vector<std::string>& of_profile);

/// Reads all installed profiles that the protocol can use. Returns a map from each name that a
/// profile lists to that profile. Files that cannot be read are skipped.
std::map<std::string, std::string> ListedNames(const Catalog& catalog,
                                               const protocols::Protocol& protocol);
/// Like ListedNames, but also with the profiles' titles (`device:`).
std::map<std::string, std::string> NamesAndTitles(const Catalog& catalog,
                                                  const protocols::Protocol& protocol);

/// A profile whose points have not been parsed, so that the keys of a device can override them.
struct RawProfile {
  Profile profile;
  std::string file;  ///< the file's name in problems
  std::vector<RawPoint> points;
};

/// Returns the file for a device's `profile:`: a name in the catalog, or a path (with a '/' or
/// ending in .yaml) relative to `base`. The error contains similar names and the searched folders.
Result<std::filesystem::path> LocateProfile(const std::string& profile,
                                            const protocols::Protocol& protocol,
                                            const Catalog& catalog,
                                            const std::filesystem::path& base);

RawProfile ReadProfile(const std::filesystem::path& path, const protocols::Protocol& protocol,
                       Problems& problems);
RawProfile ReadProfileText(const std::string& text, const std::string& file,
                           const std::string& name, const protocols::Protocol& protocol,
                           Problems& problems);

}  // namespace baudgate::config
