// What becomes of one part of the gateway, a line, listener or route, by a reload.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

namespace baudgate::reload {

enum class Fate : std::uint8_t {
  same,       ///< it goes on, and does not notice
  in_place,   ///< it goes on with what has changed
  restarted,  ///< it is ended, and begun anew
  added,
  removed,
};

}  // namespace baudgate::reload
