// When bytes came that are read now. While bytes are awaited, the line looks for them every kLook.
// If a look is late, the program was stopped or starved, or its machine was paused: what is read
// then may have come at any time since the look before. The same holds for what is read directly
// behind, because one read does not empty a port.
//
//   look before    this look    what is read has come
//   1.0 s          1.1 s        now
//   1.0 s          61.0 s       since 1.0 s
//                  61.4 s       since 1.0 s: it may have waited as well
//                  61.6 s       now
//
// A part of gateway/bus/poller/line_inputs.h.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <utility>

#include "gateway/base/time.h"

namespace baudgate {

class ArrivalTime {
 public:
  /// An input comes; `looks`: bytes were awaited before it.
  void OnInput(Instant now, bool looks) {
    const Instant before = std::exchange(last_, now);
    if (!looks || now - before <= kLook + kLate) return;
    if (now >= held_until_) held_since_ = before;
    held_until_ = now + kHeld;
  }
  /// When the next input is due, while bytes are awaited.
  Instant NextLook() const { return last_ + kLook; }
  /// When bytes that were read at this moment have come at the earliest.
  Instant Earliest(Instant read) const {
    return read >= held_since_ && read < held_until_ ? held_since_ : read;
  }

 private:
  static constexpr Duration kLook = 100ms;
  static constexpr Duration kLate = 100ms;
  static constexpr Duration kHeld = 500ms;

  Instant last_{};
  Instant held_since_{};
  Instant held_until_{};
};

}  // namespace baudgate
