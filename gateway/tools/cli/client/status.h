// `baudgate status`: what the running gateway says of itself, its lines and its devices, as tables
// with a sentence for whatever is not well, or as JSON. docs/status.md explains both.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <nlohmann/json.hpp>
#include <optional>
#include <ostream>
#include <string>

#include "gateway/base/time.h"
#include "gateway/tools/terminal/live_table.h"

namespace baudgate {

struct StatusOptions {
  std::string target;  ///< "LINE", "LINE.DEVICE", or empty: everything
  bool json = false;
  std::string socket{};                 ///< empty: the gateway in the default places
  std::optional<TableView> terminal{};  ///< empty: plain text
  bool watch = false;                   ///< see gateway/tools/cli/client/status_watch.h
  std::optional<Duration> seconds{};    ///< of `watch`: end after this time
};

/// What is said of a gateway whose answer is not understood.
std::string OtherVersion(const nlohmann::ordered_json& status);

/// Returns the exit code: 0, 2 for an unknown line or device, 4 when no gateway answers.
int RunStatus(const StatusOptions& options, std::ostream& out, std::ostream& err);

}  // namespace baudgate
