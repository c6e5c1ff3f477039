// `baudgate status`: what the running gateway says of itself, its lines and its devices, as tables
// with a sentence for whatever is not well, or as JSON. docs/status.md explains both.
// RenderStatusFrame makes one frame of `status --watch`, and RunStatusWatch draws it again and
// again.
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
  std::string target;  ///< "LINE", "LINE.DEVICE", or empty: everything
  bool json = false;
  std::string socket{};                 ///< empty: the gateway in the default places
  std::optional<TableView> terminal{};  ///< empty: plain text
  bool watch = false;                   ///< see RunStatusWatch
  std::optional<Duration> seconds{};    ///< of `watch`: end after this time
};

/// Returns the exit code: 0, 2 for an unknown line or device, 4 when no gateway answers.
int RunStatus(const StatusOptions& options, std::ostream& out, std::ostream& err);

// A status as one frame of `status --watch`: what is worst comes first, and it fits the terminal.

/// Head, lines, devices, sentences. Of what does not fit the view each part says how much it leaves
/// out. Throws a nlohmann exception where a field is missing: the gateway is of another version.
std::string RenderStatusFrame(const nlohmann::ordered_json& status, const TableView& view);

/// `all` lines for parts that want so many: a part that wants less than its share gets what it
/// wants, the others share the rest.
std::vector<std::size_t> Shares(std::size_t all, const std::vector<std::size_t>& wanted);

// `baudgate status --watch`: the status again and again on the whole screen of a terminal, until it
// is stopped. A gateway that stops is looked for again.

/// Needs options.terminal. Exit code 0; 2 for an unknown line or device; 4 when no gateway answers
/// at first.
int RunStatusWatch(const StatusOptions& options, std::ostream& out, std::ostream& err);

}  // namespace baudgate::tools
