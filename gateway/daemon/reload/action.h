// What a reload does to one part of the gateway: a line, a listener or a route.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

namespace baudgate::reload {

enum class Action : std::uint8_t {
  same,       ///< it goes on, untouched
  in_place,   ///< it goes on with what has changed
  restarted,  ///< a line is restarted; a listener loses its clients
  added,
  removed,
};

}  // namespace baudgate::reload
