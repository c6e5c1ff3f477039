// SPDX-License-Identifier: Apache-2.0
#include "config/model/serial.h"

namespace baudgate::config {

std::string SerialSettings::ToString() const {
  const char letter = parity == Parity::none ? 'N' : parity == Parity::even ? 'E' : 'O';
  return std::to_string(baud) + " " + std::to_string(data_bits) + letter +
         std::to_string(stop_bits);
}

}  // namespace baudgate::config
