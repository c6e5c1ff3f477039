// `Difference` contains what a new configuration changes in the running configuration. The reply to
// a reload, the log and `baudgate reload --dry-run` show it in the same words. Lines are compared
// by name; their order in the file does not matter. `PlaceInSlots` assigns numbers to lines and
// devices. No I/O.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "config/model/config.h"
#include "gateway/outputs/modbus/service/modbus_difference.h"

namespace baudgate::reload {

struct LineChange {
  std::string line;
  Action action = Action::same;
  std::string what;  ///< for in_place and restarted: "port; poll of feeder-1"
};

struct Difference {
  /// All lines of the new configuration in its order, then the removed lines.
  std::vector<LineChange> lines;
  ModbusDifference modbus;
  std::vector<std::string> settings;  ///< further settings that are applied: "history.points"
  std::vector<std::string> restart;   ///< settings that only a restart can change: "dds.domain"

  /// True if nothing changes except the text of the file.
  bool empty() const;
};

/// Compares two configurations. In `running`, a line without a name is a removed line.
Difference Compare(const config::Config& running, const config::Config& next);

/// Returns one sentence per change: "line bay-1: restarts: port".
std::vector<std::string> Sentences(const Difference& difference);
/// Returns e.g. "1 line new, 1 line restarted; 12 lines untouched".
std::string Summary(const Difference& difference);
/// Returns e.g. "only a restart can change dds.domain, gateway.name"; nothing if no restart is
/// needed.
std::optional<std::string> WhyNot(const Difference& difference);

// `Placement` contains the numbers of lines and devices after a reload: a line that continues keeps
// its number, a line that ends leaves its number unused, and a line that starts gets the next
// number.
//
//   running        file            after the reload
//   0 bay-1        bay-2           0 (empty, with as many nameless devices as before)
//   1 bay-2        bay-3           1 bay-2
//                                  2 bay-3
struct Placement {
  /// The configuration `next` with each line at its new number. Routes, interlocks and the history,
  /// which refer to lines and devices by number, contain the new numbers.
  config::Config config;
  std::vector<std::uint32_t> gone;
  /// Lines that continue with changed settings, or with new numbers in their interlocks.
  std::vector<std::uint32_t> updated;
  std::vector<std::uint32_t> begun;  ///< lines that must start, at the end of config.lines
};

/// `difference` is the result of Compare(running, next); it must not contain a setting that needs a
/// restart.
Placement PlaceInSlots(const config::Config& running, config::Config next,
                       const Difference& difference);

}  // namespace baudgate::reload
