// SPDX-License-Identifier: Apache-2.0
#include "protocols/common/frame_cuts.h"

namespace baudgate::cut {

Cut SkipNoise(View held, std::string_view starts, std::string_view harmless) {
  const bool calm = IsHarmless(held[0], harmless);
  const auto same = [&](std::uint8_t byte) {
    return IsHarmless(byte, harmless) == calm &&
           starts.find(static_cast<char>(byte)) == std::string_view::npos;
  };
  std::size_t size = 1;
  while (size < held.size() && same(held[size])) ++size;
  return Cut::Discard(size, calm ? Outcome::none : Outcome::partial, "noise before a frame");
}

}  // namespace baudgate::cut
