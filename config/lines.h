// The section lines: lines, their devices, and what profiles add to them.
// YAML nodes come from config/loader; structs go to config::Config.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <map>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "config/catalog/catalog.h"
#include "config/checks/uniques.h"
#include "config/model/line.h"
#include "config/profile.h"
#include "config/yaml/yaml_reader.h"

namespace baudgate::config {

/// What the readers of one file share.
struct LoadContext {
  LoadContext(const Catalog& catalog, std::filesystem::path base, Problems& problems)
      : catalog(catalog), base(std::move(base)), problems(problems), uniques(problems) {}

  const Catalog& catalog;
  std::filesystem::path base;  ///< what relative profile paths are relative to
  Problems& problems;
  Uniques uniques;
  Pace pace;            ///< what the gateway says for all lines
  AlarmSetting alarms;  ///< the same
  bool events = false;  ///< it has the key events:
  std::map<std::pair<std::string, std::string>, RawProfile> profiles;  ///< by protocol and path
  /// By protocol: names of devices, and the profile that lists them.
  std::map<std::string, std::map<std::string, std::string>> listed_names;
  std::set<std::string> bad_profiles;  ///< files whose first user has been told
  std::size_t points = 0;              ///< of all devices so far; bounds what aliases can multiply
};

std::vector<Line> ReadLines(const YamlNode& list, LoadContext& context);

}  // namespace baudgate::config
