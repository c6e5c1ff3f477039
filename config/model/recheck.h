// When a reading is asked for a second time before it counts (docs/timeouts.md).
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <string_view>

namespace baudgate::config {

enum class Recheck : std::uint8_t {
  off,
  jump,   ///< when it differs from the last by more than the point's jump
  always  ///< each time
};

std::string_view Name(Recheck recheck);

}  // namespace baudgate::config
