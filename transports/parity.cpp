// SPDX-License-Identifier: Apache-2.0
#include "transports/parity.h"

#include <bit>

namespace baudgate::transports {

std::uint8_t WithParity(std::uint8_t character, config::Parity parity) {
  if (parity == config::Parity::none) return character;
  const unsigned data = character & 0x7FU;
  const bool ones_odd = std::popcount(data) % 2 != 0;
  const bool set = ones_odd == (parity == config::Parity::even);
  return static_cast<std::uint8_t>(set ? data | 0x80U : data);
}

std::optional<std::uint8_t> WithoutParity(std::uint8_t byte, config::Parity parity) {
  if (parity == config::Parity::none) return byte;
  if (WithParity(byte, parity) != byte) return std::nullopt;
  return static_cast<std::uint8_t>(byte & 0x7FU);
}

Bytes SoftwareParity::Encode(View characters) const {
  Bytes bytes;
  bytes.reserve(characters.size());
  for (const std::uint8_t character : characters) bytes.push_back(WithParity(character, parity_));
  return bytes;
}

Bytes SoftwareParity::Decode(View bytes) {
  Bytes characters;
  characters.reserve(bytes.size());
  for (const std::uint8_t byte : bytes) {
    const auto character = WithoutParity(byte, parity_);
    if (!character) ++errors_;
    characters.push_back(character.value_or(kDamaged));
  }
  return characters;
}

config::SerialSettings OnTheWire(const config::SerialSettings& serial) {
  config::SerialSettings wire = serial;
  if (serial.software_parity) {
    wire.data_bits = 8;
    wire.parity = config::Parity::none;
  }
  return wire;
}

Status CheckSoftwareParity(const config::SerialSettings& serial) {
  if (!serial.software_parity) return {};
  if (serial.data_bits == 7 &&
      (serial.parity == config::Parity::even || serial.parity == config::Parity::odd)) {
    return {};
  }
  return Error{"software parity works with 7E and 7O only, not with " + serial.ToString() +
               "; remove `parity: software`"};
}

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
          // The kernel writes no other byte behind FF, so this byte and FF count as one damaged
          // character.
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

}  // namespace baudgate::transports
