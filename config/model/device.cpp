// SPDX-License-Identifier: Apache-2.0
#include "config/model/device.h"

namespace baudgate::config {

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
  }
  return "ABCD";
}

}  // namespace baudgate::config
