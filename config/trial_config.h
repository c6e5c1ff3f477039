// A copy of a configuration that runs beside the real gateway and touches nothing of the plant: the
// lines' ports are those of simulated devices, outputs listen on loopback, and what is kept lies in
// a folder of its own. For `baudgate simulate --write`.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "gateway/base/result.h"

namespace baudgate::config {

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
