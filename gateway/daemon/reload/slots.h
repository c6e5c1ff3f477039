// The numbers of lines and devices over reloads: what goes on keeps its number, what ends leaves an
// empty place, what begins gets the next. Pure.
//
//   running        file            slots
//   0 bay-1        bay-2           0 (empty, with as many nameless devices as before)
//   1 bay-2        bay-3           1 bay-2
//                                  2 bay-3
//
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <vector>

#include "config/model/config.h"
#include "gateway/daemon/reload/difference.h"

namespace baudgate::reload {

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
