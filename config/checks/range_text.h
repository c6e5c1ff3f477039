// Units and registers in messages: "7", "33…40".
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

namespace baudgate::config {

inline std::string RangeText(int first, int last) {
  if (first == last) return std::to_string(first);
  return std::to_string(first) + "…" + std::to_string(last);
}

}  // namespace baudgate::config
