// The length of random runs: a tenth in ctest, all if packaging/soak.sh sets $BAUDGATE_LONG_RUNS.
// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdlib>

namespace baudgate {

inline std::size_t Setting(const char* variable, std::size_t otherwise) {
  const char* text = std::getenv(variable);
  return text == nullptr ? otherwise : std::strtoul(text, nullptr, 10);
}

/// Returns how often a random run repeats its test: `all` times, or a tenth of it (at least once)
/// in ctest.
inline std::size_t LongRun(std::size_t all) {
  return Setting("BAUDGATE_LONG_RUNS", 0) != 0 ? all : std::max<std::size_t>(all / 10, 1);
}

}  // namespace baudgate
