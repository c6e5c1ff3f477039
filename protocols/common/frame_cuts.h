// Results that most frame rules return: noise, incomplete frame, bad checksum, frame too long.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string_view>

#include "protocols/frame_rule.h"

namespace baudgate::protocols::cut {

/// True for bytes that are no sign of damage: 00 and FF appear when a line driver is switched on or
/// off. `also`: more harmless characters, such as the line feed that some converters add.
constexpr bool IsHarmless(std::uint8_t byte, std::string_view also = {}) {
  return byte == 0x00 || byte == 0xFF ||
         also.find(static_cast<char>(byte)) != std::string_view::npos;
}

/// Drops bytes before the next start character: a run of harmless bytes, or a run of other bytes.
/// `held` must not begin with a start character.
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

/// For an incomplete frame: waits for more bytes; if the line is silent, drops `size` bytes as
/// partial.
constexpr Cut Wait(bool idle, std::size_t size = 1) {
  return idle ? Cut::Discard(size, Outcome::partial, "stopped mid-frame") : Cut::NeedMore();
}

constexpr Cut BadChecksum(std::size_t size = 1) {
  return Cut::Discard(size, Outcome::corrupt, "checksum");
}

constexpr Cut TooLong(std::size_t size = 1) {
  return Cut::Discard(size, Outcome::corrupt, "longer than any frame");
}

/// Drops a whole frame of a device that was not asked: the awaited frame may follow.
constexpr Cut OfAnother(std::size_t size) {
  return Cut::Discard(size, Outcome::unexpected, "not from the device that was asked");
}

}  // namespace baudgate::protocols::cut
