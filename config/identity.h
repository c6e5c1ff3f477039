// What devices call themselves: the key `identity` of profiles and devices, and what the other
// installed profiles of a protocol list. YAML comes from profile and configuration; goes to the
// conversations, which compare it with what the device says.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <map>
#include <string>
#include <vector>

#include "config/catalog/catalog.h"
#include "config/model/device.h"
#include "config/yaml/yaml_reader.h"

namespace baudgate::config {

/// `identity: ["SPAJ 140 C", "SPCJ 4D29"]`.
std::vector<std::string> ReadIdentityNames(const YamlNode& node, Problems& problems);

/// A device's `identity:`, a list or `ignore`; without it the profile's names.
Identity ReadIdentity(MapReader& map, const std::vector<std::string>& of_profile);

/// Which installed profile that the protocol can use lists a name. Files that cannot
/// be read list none.
std::map<std::string, std::string> ListedNames(const Catalog& catalog, const Protocol& protocol);
/// The same and their titles (`device:`), which no profile needs to list.
std::map<std::string, std::string> NamesAndTitles(const Catalog& catalog, const Protocol& protocol);

}  // namespace baudgate::config
