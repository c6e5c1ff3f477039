// Device profiles: config/profiles/<protocol>/<name>.yaml, found through the catalog or by path.
// Files come from disk; what they say goes to the devices of config/lines. ReadOptions reads the
// keys of a protocol, and ReadIdentity the key `identity`.
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

// The keys of a line or device that its protocol declares. YAML nodes come from config/lines,
// config/devices and config/profile; values go to config::Options.

/// The options of that scope that stand in `map`. Those of the other scope are refused, and the
/// message says where they belong.
Options ReadOptions(MapReader& map, const protocols::Protocol& protocol,
                    protocols::OptionSpec::Scope scope);

// What devices call themselves: the key `identity` of profiles and devices, and what the other
// installed profiles of a protocol list. YAML comes from profile and configuration; goes to the
// conversations, which compare it with what the device says.

/// A device's `identity:`, a list or `ignore`; without it the profile's names.
Identity ReadIdentity(MapReader& map, const std::vector<std::string>& of_profile);

/// Which installed profile that the protocol can use lists a name. Files that cannot
/// be read list none.
std::map<std::string, std::string> ListedNames(const Catalog& catalog,
                                               const protocols::Protocol& protocol);
/// The same and their titles (`device:`), which no profile needs to list.
std::map<std::string, std::string> NamesAndTitles(const Catalog& catalog,
                                                  const protocols::Protocol& protocol);

/// A profile before its points are read, so that a device can put its own keys over them.
struct RawProfile {
  Profile profile;   ///< without points
  std::string file;  ///< as its problems name it
  std::vector<RawPoint> points;
};

/// What a device's `profile:` leads to: a name in the catalog, or a path (with a '/' or ending in
/// .yaml) relative to `base`. An error names near misses and where was searched.
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
