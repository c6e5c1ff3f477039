// `baudgate status`: prints the state of the running gateway as tables with a sentence for each
// problem, or as JSON; see docs/status.md. RunStatusWatch prints it again and again.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <nlohmann/json.hpp>
#include <optional>
#include <ostream>
#include <string>
#include <vector>

#include "gateway/base/time.h"
#include "gateway/tools/terminal/live_table.h"

namespace baudgate::tools {

struct StatusOptions {
  std::string target;  ///< "LINE" or "LINE.DEVICE"; empty: all lines
  bool json = false;
  std::string socket{};  ///< path of the control socket; empty: the only running gateway is used
  std::optional<TableView> terminal{};  ///< empty: plain text
  bool watch = false;
  std::optional<Duration> seconds{};  ///< with `watch`: end after this time
};

/// Exit codes: 0 done; 2 unknown line or device; 4 no gateway answers, or one of another version.
int RunStatus(const StatusOptions& options, std::ostream& out, std::ostream& err);

/// Returns one screen of `status --watch`, the lines and devices with the worst troubles first. A
/// part that does not fit ends with the number of rows left out. Throws a nlohmann exception if the
/// answer is that of another version of the gateway.
std::string RenderStatusFrame(const nlohmann::ordered_json& status, const TableView& view);

/// Divides `all` screen lines among parts that want `wanted` lines. A part that wants less than its
/// share gets what it wants; the other parts share the rest.
std::vector<std::size_t> Shares(std::size_t all, const std::vector<std::size_t>& wanted);

// `baudgate status --watch`: redraws the status until the command is stopped. If the gateway stops,
// waits until it runs again.

/// `options.terminal` must be set. Exit codes: 0 stopped; 2 unknown line or device; 4 no gateway
/// answers at the start.
int RunStatusWatch(const StatusOptions& options, std::ostream& out, std::ostream& err);

}  // namespace baudgate::tools
