// How long random runs are: in ctest a tenth of what they are by packaging/soak.sh, which sets
// $BAUDGATE_LONG_RUNS.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdlib>

namespace baudgate {

/// The environment variable as a number; `otherwise` where it is not set.
inline std::size_t Setting(const char* variable, std::size_t otherwise) {
  const char* text = std::getenv(variable);
  return text == nullptr ? otherwise : std::strtoul(text, nullptr, 10);
}

/// Rounds, seeds, exchanges, minutes: `all` of them or a tenth.
inline std::size_t LongRun(std::size_t all) {
  return Setting("BAUDGATE_LONG_RUNS", 0) != 0 ? all : std::max<std::size_t>(all / 10, 1);
}

}  // namespace baudgate
