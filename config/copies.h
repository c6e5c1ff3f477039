// Copies of a configuration. MaskedConfig makes a copy that can be given away, without secrets and
// without comments, which may contain secrets too. MakeTrialConfig makes a copy that runs beside
// the real gateway and does not touch the plant.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <set>
#include <string>
#include <vector>

#include "config/catalog/catalog.h"
#include "gateway/base/result.h"

namespace baudgate::config {

std::set<std::string> SecretKeys(const Catalog& catalog);

/// Returns the YAML with "***" instead of the values of secret keys, of keys that look like
/// misspelt secret keys, and of copies of secret values. Fails if the text is not YAML, or if
/// aliases make it endless or too large.
Result<std::string> MaskedConfig(const std::string& yaml, const std::set<std::string>& secrets);

// TrialPlaces contains the places that a trial configuration uses (`baudgate simulate --write`):
// ports of simulated devices, profiles, and a separate folder for stored data.
struct TrialPlaces {
  std::vector<std::string> ports;  ///< ports of the lines, in the order of the file
  std::filesystem::path profiles;  ///< base of relative profile paths; absolute
  std::filesystem::path state;     ///< folder for all data that the trial stores
};

struct TrialConfig {
  std::string yaml;
  std::vector<std::string> left_out;  ///< one sentence for each part that was left out
};

/// `yaml` must be a configuration that LoadText accepts. Comments are not copied.
Result<TrialConfig> MakeTrialConfig(const std::string& yaml, const TrialPlaces& places);

}  // namespace baudgate::config
