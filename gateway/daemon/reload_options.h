// How a gateway that was started from a file reads that file again. Provided by the program that
// starts it.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "config/model/config.h"
#include "gateway/base/result.h"
#include "gateway/base/time.h"
#include "gateway/daemon/reload/trial.h"

namespace baudgate {

/// A text as a configuration, or why it is invalid.
struct LoadedText {
  std::optional<config::Config> config;
  std::vector<std::string> problems;  ///< "…yaml:7:3: …"; only warnings if there is a configuration
};

struct ReloadOptions {
  std::string file;
  std::function<Result<std::string>()> read;                ///< the file, as it is now
  std::function<LoadedText(const std::string& text)> load;  ///< paths in it are the file's
  std::function<void(const std::string& state)> notify;     ///< as sd_notify
  std::function<std::string()> summary;                     ///< what runs, for READY=1
  /// A text without its secrets; empty: they cannot be found.
  std::function<Result<std::string>(const std::string& text)> masked{};
  std::string text_at_start;                ///< the text that runs
  std::optional<reload::Refused> refused;   ///< the text of the file, if it was taken back
  std::optional<reload::KeptConfigs> kept;  ///< empty: there is no folder
  Duration disk_patience = 5s;              ///< how long an answer waits for a file
};

}  // namespace baudgate
