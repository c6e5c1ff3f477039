// What a new configuration changes of the one that runs, in the same words for the answer, in the
// log and before it is done (`baudgate reload --dry-run`). Pure. Lines are compared by name;
// their order in the file does not count. PlaceInSlots gives lines and devices their numbers.
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
  std::string what;  ///< "port; poll of feeder-1"; of `in_place` and `restarted`
};

struct Difference {
  std::vector<LineChange> lines;  ///< all of the new one in its order, then those removed
  ModbusDifference modbus;
  std::vector<std::string> settings;  ///< beside these, that are applied: "history.points"
  std::vector<std::string> restart;   ///< that only a restart can change: "dds.domain"

  /// Nothing changes but the text.
  bool empty() const;
};

/// In `running` a line without a name is one that is gone.
Difference Compare(const config::Config& running, const config::Config& next);

/// One for each change: "line bay-1: restarts: port".
std::vector<std::string> Sentences(const Difference& difference);
/// "1 line new, 1 line restarted; 12 lines untouched".
std::string Summary(const Difference& difference);
/// "only a restart can change dds.domain, gateway.name", if anything needs one.
std::optional<std::string> WhyNot(const Difference& difference);

// The numbers of lines and devices over reloads: what goes on keeps its number, what ends leaves an
// empty place, what begins gets the next. Pure.
//
//   running        file            slots
//   0 bay-1        bay-2           0 (empty, with as many nameless devices as before)
//   1 bay-2        bay-3           1 bay-2
//                                  2 bay-3
//
struct Placement {
  /// `next`, with its lines at their places. Whatever names a line or device by its number (routes,
  /// interlocks, the history) has the new one.
  config::Config config;
  std::vector<std::uint32_t> gone;     ///< lines to be ended
  std::vector<std::uint32_t> updated;  ///< lines that go on with what has changed
  std::vector<std::uint32_t> begun;    ///< at the end of config.lines
};

/// `difference` is that of the two; nothing in it needs a restart.
Placement PlaceInSlots(const config::Config& running, config::Config next,
                       const Difference& difference);

}  // namespace baudgate::reload
