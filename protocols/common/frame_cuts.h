// Results (Cut) that most frame rules return: noise, incomplete frame, bad checksum, frame of
// another device.
#pragma once

#include <string_view>

#include "protocols/frame_rule.h"

namespace baudgate::protocols::cut {

/// True if `byte` is harmless noise: 00 and FF appear when a line driver is switched on or off.
/// `also`: further harmless characters, such as the line feed that some converters add.
constexpr bool IsHarmless(std::uint8_t byte, std::string_view also = {}) {
  return byte == 0x00 || byte == 0xFF ||
         also.find(static_cast<char>(byte)) != std::string_view::npos;
}

/// Drops the bytes in front of the next start character. One call drops only harmless bytes, or
/// only bytes that are not harmless. `held` must not begin with a start character.
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

inline Cut Slide(View held, std::string_view why) {
  return Cut::Discard(1, IsHarmless(held[0]) ? Outcome::none : Outcome::partial, why);
}

/// Result for an incomplete frame: waits for more bytes. If the line is silent, no more will come,
/// so `size` bytes are dropped as partial.
constexpr Cut Wait(bool idle, std::size_t size = 1) {
  return idle ? Cut::Discard(size, Outcome::partial, "stopped mid-frame") : Cut::NeedMore();
}

constexpr Cut BadChecksum(std::size_t size = 1) {
  return Cut::Discard(size, Outcome::corrupt, "checksum");
}

constexpr Cut TooLong(std::size_t size = 1) {
  return Cut::Discard(size, Outcome::corrupt, "the bytes are longer than any frame");
}

/// Drops a whole frame that another device has sent; the awaited frame can still follow.
constexpr Cut OfAnother(std::size_t size) {
  return Cut::Discard(size, Outcome::unexpected, "the reply is not from the device that was asked");
}

}  // namespace baudgate::protocols::cut
