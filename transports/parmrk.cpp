// A three-state reader of the marks that n_tty writes; bytes come from read() on the port.
// SPDX-License-Identifier: Apache-2.0
#include "transports/parmrk.h"

#include "transports/damage.h"

namespace baudgate {

void ParmrkDecoder::Damage(Bytes& characters) {
  ++damaged_;
  characters.push_back(kDamaged);
  state_ = State::plain;
}

Bytes ParmrkDecoder::Decode(View bytes) {
  Bytes characters;
  characters.reserve(bytes.size());
  for (const std::uint8_t byte : bytes) {
    switch (state_) {
      case State::plain:
        if (byte == 0xFF) {
          state_ = State::after_ff;
        } else {
          characters.push_back(byte);
        }
        break;
      case State::after_ff:
        if (byte == 0xFF) {
          characters.push_back(0xFF);
          state_ = State::plain;
        } else if (byte == 0x00) {
          state_ = State::after_ff_00;
        } else {
          // The kernel writes no other mark; whatever this is, it is no clean character.
          Damage(characters);
        }
        break;
      case State::after_ff_00:
        Damage(characters);
        break;
    }
  }
  return characters;
}

}  // namespace baudgate
