// Parity made and checked in software, for 7E1 and 7O1 devices on ports that know 8N1 only: seven
// data bits, and the parity bit in the place of the eighth. Bytes come from and go to a transport.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>
#include <optional>

#include "config/model/serial.h"
#include "gateway/base/bytes.h"

namespace baudgate {

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

}  // namespace baudgate
