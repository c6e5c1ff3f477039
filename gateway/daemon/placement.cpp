// SPDX-License-Identifier: Apache-2.0
#include "gateway/daemon/placement.h"

#include <algorithm>

namespace baudgate {

Place PlaceOf(std::string_view port) {
  const bool never_blocks = port.starts_with("tcp://") || port.starts_with("/dev/pts/");
  return never_blocks ? Place::shared_loop : Place::own_thread;
}

Placement PlaceLines(const std::vector<config::Line>& lines, std::size_t cores) {
  const auto sharing = static_cast<std::size_t>(std::ranges::count_if(
      lines, [](const config::Line& line) { return PlaceOf(line.port) == Place::shared_loop; }));
  Placement placement;
  placement.loops = std::clamp<std::size_t>(std::min(cores, sharing), 1, Placement::kMostLoops);
  std::size_t turn = 0;
  for (const config::Line& line : lines) {
    const bool shares = PlaceOf(line.port) == Place::shared_loop;
    placement.loop_of.push_back(shares ? turn++ % placement.loops : Placement::kOwn);
  }
  return placement;
}

}  // namespace baudgate
