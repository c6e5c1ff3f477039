// Who may look at the bytes of one line, with direction and time: trace and recordings. Bytes come
// from the line, as they stood on the wire, and go to whoever the program attaches.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

#include "gateway/base/bytes.h"
#include "gateway/base/time.h"

namespace baudgate {

enum class Direction : std::uint8_t { sent, received };

class Tap {
 public:
  virtual ~Tap() = default;
  /// On the line's thread. The bytes are valid during the call only; the call must not block.
  virtual void OnBytes(Direction direction, View bytes, Instant when) = 0;
};

}  // namespace baudgate
