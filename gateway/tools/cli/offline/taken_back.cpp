// SPDX-License-Identifier: Apache-2.0
#include "gateway/tools/cli/offline/taken_back.h"

#include "gateway/base/whole_file.h"
#include "gateway/daemon/reload/kept_configs.h"
#include "gateway/records/disk/state_folder.h"

namespace baudgate {

std::optional<config::Problem> WhyTakenBack(const std::string& file, const config::Config& config) {
  const auto folder = StateFolderOf(StatePlaces::Here(config.state), config.name);
  const reload::KeptConfigs kept(folder / reload::KeptConfigs::kFolder);
  const auto text = ReadWhole(file);
  if (!text || !kept.IsUnconfirmed(*text)) return std::nullopt;
  const std::string copy = kept.confirmed_file().string();
  const std::string why =
      kept.trial() == reload::KeptConfigs::Trial::running
          ? "is on trial, and taken back unless somebody confirms it (baudgate confirm)"
          : "was taken back: " + kept.why_taken_back() + "; while this file is as it is, " + copy +
                " runs (diff " + copy + " " + file + ")";
  return config::Problem{{file, 0, 0}, why, true};
}

}  // namespace baudgate
