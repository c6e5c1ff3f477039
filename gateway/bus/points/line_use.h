// What the time of a line goes to.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <string_view>

#include "gateway/base/time.h"

namespace baudgate {

enum class LineUse : std::uint8_t {
  polls,    ///< answered exchanges that read
  probes,   ///< answered probes
  routes,   ///< answered ones of clients
  writes,   ///< answered ones, with the reads after them
  silence,  ///< exchanges without a good reply
  drains,   ///< silence that is kept after an exchange
};
inline constexpr std::size_t kLineUses = 6;

constexpr std::string_view Name(LineUse use) {
  constexpr std::string_view kNames[kLineUses] = {"polls",  "probes",  "routes",
                                                  "writes", "silence", "drains"};
  return kNames[static_cast<std::size_t>(use)];
}

/// Times by use.
using TimeByUse = std::array<Duration, kLineUses>;
/// Parts of a time, each 0 to 1; for the rest the line was idle.
using LineShares = std::array<double, kLineUses>;

}  // namespace baudgate
