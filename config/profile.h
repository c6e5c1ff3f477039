// Device profiles: config/profiles/<protocol>/<name>.yaml, found through the catalog or by path.
// Files come from disk; what they say goes to the devices of config/lines.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "config/catalog/catalog.h"
#include "config/model/problem.h"
#include "config/points.h"

namespace baudgate::config {

/// A profile before its points are read, so that a device can put its own keys over them.
struct RawProfile {
  Profile profile;   ///< without points
  std::string file;  ///< as its problems name it
  std::vector<RawPoint> points;
};

/// What a device's `profile:` leads to: a name in the catalog, or a path (with a '/' or ending in
/// .yaml) relative to `base`. An error names near misses and where was searched.
Result<std::filesystem::path> LocateProfile(const std::string& profile, const Protocol& protocol,
                                            const Catalog& catalog,
                                            const std::filesystem::path& base);

RawProfile ReadProfile(const std::filesystem::path& path, const Protocol& protocol,
                       Problems& problems);
RawProfile ReadProfileText(const std::string& text, const std::string& file,
                           const std::string& name, const Protocol& protocol, Problems& problems);

/// Shared with devices, which have the same key.
std::optional<WordOrder> ReadWordOrder(MapReader& map);

}  // namespace baudgate::config
