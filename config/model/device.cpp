// SPDX-License-Identifier: Apache-2.0
#include "config/model/device.h"

namespace baudgate::config {

std::string SpokenName(std::string_view name) {
  std::string spoken;
  for (const char c : name) {
    if (c > ' ') spoken += c >= 'a' && c <= 'z' ? static_cast<char>(c - 'a' + 'A') : c;
  }
  return spoken;
}

std::string_view Name(WordOrder order) {
  switch (order) {
    case WordOrder::abcd:
      return "ABCD";
    case WordOrder::cdab:
      return "CDAB";
    case WordOrder::badc:
      return "BADC";
    case WordOrder::dcba:
      return "DCBA";
    case WordOrder::cdabghef:
      return "CDABGHEF";
  }
  return "ABCD";
}

}  // namespace baudgate::config
