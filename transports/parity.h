// `SoftwareParity` makes and checks parity bits for 7E1 and 7O1 devices on ports that support only
// 8N1: seven data bits, and the parity bit as the eighth. ParmrkDecoder decodes the marks that a
// Linux tty puts into its input.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>

#include "config/model/serial.h"
#include "gateway/base/bytes.h"

namespace baudgate::transports {

/// The byte that replaces a character damaged by a parity error, framing error or break. It is not
/// dropped, because ">+12.3" with a missing digit would still be a valid number if there is no
/// checksum. 0xFF occurs in no ASCII protocol, and one wrong byte never passes a CRC-16.
inline constexpr std::uint8_t kDamaged = 0xFF;

/// Returns the low seven bits with the parity bit as the eighth. Parity none: returns the byte
/// unchanged.
std::uint8_t WithParity(std::uint8_t character, config::Parity parity);

/// Returns the low seven bits, or nothing if the parity bit is wrong. Parity none: returns the byte
/// unchanged.
std::optional<std::uint8_t> WithoutParity(std::uint8_t byte, config::Parity parity);

class SoftwareParity {
 public:
  explicit SoftwareParity(config::Parity parity = config::Parity::none) : parity_(parity) {}

  Bytes Encode(View characters) const;
  /// Replaces characters with wrong parity by kDamaged and counts them.
  Bytes Decode(View bytes);
  std::uint32_t errors() const { return errors_; }

 private:
  config::Parity parity_;
  std::uint32_t errors_ = 0;
};

/// Returns the settings that the port must have. Example: 7E1 with software parity needs 8N1.
config::SerialSettings OnTheWire(const config::SerialSettings& serial);

/// Checks that software parity is used with seven data bits and even or odd parity only.
Status CheckSoftwareParity(const config::SerialSettings& serial);

// Decodes the input of a Linux tty in PARMRK mode: FF FF is a received FF, FF 00 x is a character x
// with wrong parity or framing, FF 00 00 may also be a break.
class ParmrkDecoder {
 public:
  /// Returns the characters, with kDamaged for each marked character. A mark can be split between
  /// two calls.
  Bytes Decode(View bytes);
  std::uint32_t damaged() const { return damaged_; }

 private:
  enum class State : std::uint8_t { plain, after_ff, after_ff_00 };

  void Damage(Bytes& characters);

  State state_ = State::plain;
  std::uint32_t damaged_ = 0;
};

}  // namespace baudgate::transports
