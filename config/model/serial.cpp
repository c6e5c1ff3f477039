// SPDX-License-Identifier: Apache-2.0
#include "config/model/serial.h"

#include <string_view>

namespace baudgate::config {
namespace {

constexpr std::string_view kLetters = "NEOMS";  // in the order of Parity

}  // namespace

char LetterOf(Parity parity) { return kLetters[static_cast<std::size_t>(parity)]; }

std::optional<Parity> ParityOf(char letter) {
  const char upper =
      letter >= 'a' && letter <= 'z' ? static_cast<char>(letter - 'a' + 'A') : letter;
  const auto place = kLetters.find(upper);
  if (place == std::string_view::npos) return std::nullopt;
  return static_cast<Parity>(place);
}

std::string SerialSettings::ToString() const {
  return std::to_string(baud) + " " + std::to_string(data_bits) + LetterOf(parity) +
         std::to_string(stop_bits);
}

}  // namespace baudgate::config
