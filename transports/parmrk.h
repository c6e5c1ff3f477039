// Reads the marks that a Linux tty in PARMRK mode puts into its input: FF FF is a received FF,
// FF 00 x is a character x with wrong parity or framing, FF 00 00 also a break. Bytes come from
// read() on the port and go on as characters.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

#include "gateway/base/bytes.h"

namespace baudgate {

class ParmrkDecoder {
 public:
  /// Any fragmentation gives the same characters. A marked character becomes kDamaged.
  Bytes Decode(View bytes);
  /// Damaged characters and breaks so far.
  std::uint32_t damaged() const { return damaged_; }

 private:
  enum class State : std::uint8_t { plain, after_ff, after_ff_00 };

  void Damage(Bytes& characters);

  State state_ = State::plain;
  std::uint32_t damaged_ = 0;
};

}  // namespace baudgate
