// The answers that most frame rules give in the same words: noise, more to come, too long.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string_view>

#include "protocols/frame_rule.h"

namespace baudgate::protocols::cut {

/// 00 and FF appear when a line driver is switched on or off. `also`: what else is no sign of
/// damage, such as the line feed that some converters add.
constexpr bool IsHarmless(std::uint8_t byte, std::string_view also = {}) {
  return byte == 0x00 || byte == 0xFF ||
         also.find(static_cast<char>(byte)) != std::string_view::npos;
}

/// Drops what stands before the next start character: a run of harmless bytes, or one of others.
/// `held` begins with no start character.
inline Cut SkipNoise(View held, std::string_view starts, std::string_view harmless = {}) {
  const bool calm = IsHarmless(held[0], harmless);
  const auto same = [&](std::uint8_t byte) {
    return IsHarmless(byte, harmless) == calm &&
           starts.find(static_cast<char>(byte)) == std::string_view::npos;
  };
  std::size_t size = 1;
  while (size < held.size() && same(held[size])) ++size;
  return Cut::Discard(size, calm ? Outcome::none : Outcome::partial, "noise before a frame");
}

/// Drops one byte that begins no frame.
inline Cut Slide(View held, std::string_view why) {
  return Cut::Discard(1, IsHarmless(held[0]) ? Outcome::none : Outcome::partial, why);
}

/// Not whole yet: more may come, unless the line is silent. Then `size` bytes are no frame.
constexpr Cut Wait(bool idle, std::size_t size = 1) {
  return idle ? Cut::Discard(size, Outcome::partial, "stopped mid-frame") : Cut::NeedMore();
}

constexpr Cut BadChecksum(std::size_t size = 1) {
  return Cut::Discard(size, Outcome::corrupt, "checksum");
}

constexpr Cut TooLong(std::size_t size = 1) {
  return Cut::Discard(size, Outcome::corrupt, "longer than any frame");
}

/// A whole frame, but of another device than was asked: the awaited one may follow it.
constexpr Cut OfAnother(std::size_t size) {
  return Cut::Discard(size, Outcome::unexpected, "not from the device that was asked");
}

}  // namespace baudgate::protocols::cut
