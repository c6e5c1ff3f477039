// SPDX-License-Identifier: Apache-2.0
#include "gateway/lines/placement.h"

#include <algorithm>

namespace baudgate {

Place PlaceOf(std::string_view port) {
  const bool never_blocks = port.starts_with("tcp://") || port.starts_with("/dev/pts/");
  return never_blocks ? Place::shared_loop : Place::own_thread;
}

std::size_t SharedLoops(const std::vector<config::Line>& lines, std::size_t cores) {
  constexpr std::size_t kMost = 4;
  const auto sharing = static_cast<std::size_t>(std::ranges::count_if(
      lines, [](const config::Line& line) { return PlaceOf(line.port) == Place::shared_loop; }));
  return std::clamp<std::size_t>(std::min(cores, sharing), 1, kMost);
}

}  // namespace baudgate
