// Parity made and checked in software, for 7E1 and 7O1 devices on ports that know 8N1 only: seven
// data bits, and the parity bit in the place of the eighth. Bytes come from and go to a transport.
// ParmrkDecoder reads the marks that a Linux tty puts into its input.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>

#include "config/model/serial.h"
#include "gateway/base/bytes.h"

namespace baudgate::transports {

// What stands in the place of a character that arrived damaged (parity, framing, break).

/// Not dropped: without a checksum ">+12.3" with one digit missing is still a valid number. 0xFF is
/// no character of any ASCII protocol, and one changed byte never passes a CRC-16.
inline constexpr std::uint8_t kDamaged = 0xFF;

/// The low seven bits with the parity bit on top. Parity none: the byte as it is.
std::uint8_t WithParity(std::uint8_t character, config::Parity parity);

/// The low seven bits, or nothing when the parity bit is wrong. Parity none: the byte as it is.
std::optional<std::uint8_t> WithoutParity(std::uint8_t byte, config::Parity parity);

class SoftwareParity {
 public:
  explicit SoftwareParity(config::Parity parity = config::Parity::none) : parity_(parity) {}

  Bytes Encode(View characters) const;
  /// A character with wrong parity becomes kDamaged and is counted.
  Bytes Decode(View bytes);
  std::uint32_t errors() const { return errors_; }

 private:
  config::Parity parity_;
  std::uint32_t errors_ = 0;
};

/// What the port has to be set to for these settings: 8N1 in place of 7E1 with software parity.
config::SerialSettings OnTheWire(const config::SerialSettings& serial);

/// Software parity exists for seven data bits with even or odd parity only.
Status CheckSoftwareParity(const config::SerialSettings& serial);

// Reads the marks that a Linux tty in PARMRK mode puts into its input: FF FF is a received FF,
// FF 00 x is a character x with wrong parity or framing, FF 00 00 also a break. Bytes come from
// read() on the port and go on as characters.
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

}  // namespace baudgate::transports
