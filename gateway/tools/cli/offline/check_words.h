// Words that the parts of `baudgate check` share.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>
#include <vector>

#include "config/model/network.h"

namespace baudgate {

template <typename Range, typename Text>
std::string Joined(const Range& range, Text text) {
  std::string joined;
  for (const auto& one : range) {
    if (!joined.empty()) joined += ", ";
    joined += text(one);
  }
  return joined;
}

/// "everybody who reaches it", "10.0.0.7, 10.1.0.0/16".
inline std::string Whom(const std::vector<config::Network>& allow) {
  if (allow.empty()) return "everybody who reaches it";
  return Joined(allow, [](const auto& network) { return network.text; });
}

}  // namespace baudgate
