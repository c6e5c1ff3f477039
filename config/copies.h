// A configuration that may be given away: without the values of secrets, and without comments,
// which may have some as well. MakeTrialConfig makes a copy that runs beside the real gateway and
// touches nothing of the plant.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <set>
#include <string>
#include <vector>

#include "config/catalog/catalog.h"
#include "gateway/base/result.h"

namespace baudgate::config {

/// The names of all options that a protocol declares secret.
std::set<std::string> SecretKeys(const Catalog& catalog);

/// The same YAML with "***" in place of what follows a secret key, or a key that is likely
/// one misspelt, and of every copy of such a value. An error where it is no YAML, or grows without
/// end.
Result<std::string> MaskedConfig(const std::string& yaml, const std::set<std::string>& secrets);

// A copy of a configuration that runs beside the real gateway and touches nothing of the plant: the
// lines' ports are those of simulated devices, outputs listen on loopback, and what is kept lies in
// a folder of its own. For `baudgate simulate --write`.
struct TrialPlaces {
  std::vector<std::string> ports;  ///< of the lines, in the order of the file
  std::filesystem::path profiles;  ///< what relative profile paths are relative to; absolute
  std::filesystem::path state;     ///< where the trial keeps what it keeps
};

struct TrialConfig {
  std::string yaml;
  std::vector<std::string> left_out;  ///< a sentence each
};

/// `yaml` is the text of a configuration that LoadText accepts. Comments are not copied.
Result<TrialConfig> MakeTrialConfig(const std::string& yaml, const TrialPlaces& places);

}  // namespace baudgate::config
